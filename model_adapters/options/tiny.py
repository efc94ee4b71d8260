"""Options of tiny models; their weights come from the run's seed."""

from dataclasses import dataclass

from model_adapters.options.checkpoints import HfOptions
from model_adapters.options.families import PixelLimits
from model_adapters.options.policies import PolicyOptions, SpatialVLAOptions

__all__ = ["OpenVLATinyOptions", "Qwen25VLTinyOptions", "SpatialVLATinyOptions", "TinyOptions"]


@dataclass(frozen=True, kw_only=True)
class TinyOptions(HfOptions):
    """Options of tiny models.

    Attributes:
        dtype: float32 unless told otherwise, so that replies do not hang on rounding.
        device: cpu unless told otherwise.
    """

    dtype: str = "float32"
    device: str = "cpu"


@dataclass(frozen=True, kw_only=True)
class Qwen25VLTinyOptions(PixelLimits, TinyOptions):
    """Options of `qwen2.5-vl-tiny`."""


@dataclass(frozen=True, kw_only=True)
class OpenVLATinyOptions(PolicyOptions):
    """Options of `openvla-tiny`."""

    dtype: str = "float32"
    device: str = "cpu"


@dataclass(frozen=True, kw_only=True)
class SpatialVLATinyOptions(SpatialVLAOptions):
    """Options of `spatialvla-tiny`."""

    dtype: str = "float32"
    device: str = "cpu"
