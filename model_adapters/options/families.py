"""Options of the model families of transformers; default checkpoints are in `built_in.py`."""

from dataclasses import dataclass
from typing import Annotated, Any

from infthor_eval.quantities import Total
from infthor_eval.settings import Setting
from infthor_eval.storage.limits import IMAGE_MEGAPIXELS
from model_adapters.options.checkpoints import (
    CheckpointOptions,
    FrameScaling,
    HfOptions,
    ModelOptions,
)


@dataclass(frozen=True, kw_only=True)
class PixelLimits(ModelOptions):
    """Limits of a frame's area."""

    min_pixels: Annotated[
        Total | None,
        Setting(
            help="Area that smaller frames are enlarged to; default: the checkpoint's setting.",
            of="pixels",
        ),
    ] = None
    max_pixels: Annotated[
        Total | None,
        Setting(
            help="Area that larger frames are reduced to; default: the checkpoint's setting.",
            of="pixels",
        ),
    ] = None

    def __post_init__(self) -> None:
        most = IMAGE_MEGAPIXELS.value * 1_000_000
        for name, value in self.image_settings().items():
            if value > most:
                raise ValueError(f"{name}={value}: give at most {most:,}, as pictures have")
        if (
            self.min_pixels is not None
            and self.max_pixels is not None
            and self.min_pixels > self.max_pixels
        ):
            raise ValueError(f"min_pixels={self.min_pixels} is above max_pixels={self.max_pixels}")
        super().__post_init__()

    def image_settings(self) -> dict[str, int]:
        """Return the image processor settings that differ from the checkpoint's."""
        limits = {"min_pixels": self.min_pixels, "max_pixels": self.max_pixels}
        return {name: value for name, value in limits.items() if value is not None}


@dataclass(frozen=True, kw_only=True)
class PixelOptions(PixelLimits, CheckpointOptions):
    """Options of `qwen2.5-vl`."""


@dataclass(frozen=True, kw_only=True)
class TinyPixelOptions(PixelLimits, HfOptions):
    """Options of `qwen2.5-vl-tiny`, which has no checkpoint."""


@dataclass(frozen=True, kw_only=True)
class HfVlmOptions(FrameScaling, CheckpointOptions):
    """Options of `hf-vlm`."""


@dataclass(frozen=True, kw_only=True)
class PixelVlmOptions(PixelLimits, HfVlmOptions):
    """Options of models that `hf-vlm` runs, whose frames have limits of their area."""


@dataclass(frozen=True, kw_only=True)
class Gemma4Options(HfVlmOptions):
    """Options of `gemma4`."""

    soft_tokens: Annotated[
        int | None,
        Setting(
            help="Most tokens of a frame; default: the checkpoint's setting (280).",
            choices=(70, 140, 280, 560, 1120),  # that it was trained with
        ),
    ] = None

    def image_settings(self) -> dict[str, Any]:
        """Return the image processor settings that differ from the checkpoint's."""
        return {} if self.soft_tokens is None else {"max_soft_tokens": self.soft_tokens}
