"""infthor-eval: evaluation of multimodal models on long-horizon embodied tasks (∞-THOR)."""

__all__ = ["__version__"]

__version__ = "0.1.0"
