"""Options of tiny models, whose weights are drawn by the run's seed."""

from dataclasses import dataclass

from model_adapters.options.checkpoints import HfOptions
from model_adapters.options.families import PixelLimits
from model_adapters.options.policies import PolicyOptions, SpatialVLAOptions

__all__ = ["OpenVLATinyOptions", "Qwen25VLTinyOptions", "SpatialVLATinyOptions", "TinyOptions"]


@dataclass(frozen=True, kw_only=True)
class TinyOptions(HfOptions):
    """Options of tiny models.

    Attributes:
        dtype: float32 by default, so that replies do not depend on rounding.
        device: cpu by default.
        threads: 1 by default: tiny tensors gain nothing from more, and on a busy machine waiting for the slowest thread
            makes each operation many times slower.
    """

    dtype: str = "float32"
    device: str = "cpu"
    threads: int | None = 1


@dataclass(frozen=True, kw_only=True)
class Qwen25VLTinyOptions(PixelLimits, TinyOptions):
    """Options of `qwen2.5-vl-tiny`."""


@dataclass(frozen=True, kw_only=True)
class OpenVLATinyOptions(PolicyOptions):
    """Options of `openvla-tiny`."""

    dtype: str = "float32"
    device: str = "cpu"
    threads: int | None = 1


@dataclass(frozen=True, kw_only=True)
class SpatialVLATinyOptions(SpatialVLAOptions):
    """Options of `spatialvla-tiny`."""

    dtype: str = "float32"
    device: str = "cpu"
    threads: int | None = 1
