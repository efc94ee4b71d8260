"""Options of tiny models, whose weights are drawn by the run's seed."""

from dataclasses import dataclass

from model_adapters.options.checkpoints import HfOptions
from model_adapters.options.families import PixelLimits
from model_adapters.options.policies import FrameCrop, PolicyOptions, SpatialVLAOptions


@dataclass(frozen=True, kw_only=True)
class _TinyPlacement:
    """Defaults of tiny models.

    Attributes:
        dtype: float32, so that replies do not depend on rounding.
        device: cpu.
        threads: 1: tiny tensors gain nothing from more, and on a busy machine waiting for the
            slowest thread makes each operation many times slower.
    """

    dtype: str = "float32"
    device: str = "cpu"
    threads: int | None = 1


@dataclass(frozen=True, kw_only=True)
class TinyOptions(_TinyPlacement, HfOptions):
    """Options of tiny models."""


@dataclass(frozen=True, kw_only=True)
class Qwen25VLTinyOptions(PixelLimits, TinyOptions):
    """Options of `qwen2.5-vl-tiny`."""


@dataclass(frozen=True, kw_only=True)
class OpenVLATinyOptions(FrameCrop, _TinyPlacement, PolicyOptions):
    """Options of `openvla-tiny`."""


@dataclass(frozen=True, kw_only=True)
class SpatialVLATinyOptions(_TinyPlacement, SpatialVLAOptions):
    """Options of `spatialvla-tiny`."""
