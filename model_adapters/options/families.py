"""Options of the model families of transformers, each with its default checkpoint."""

from dataclasses import dataclass
from typing import Any

from infthor_eval.storage.limits import IMAGE_MEGAPIXELS
from model_adapters.options.checkpoints import CheckpointOptions, FrameScaling

_SOFT_TOKENS = (70, 140, 280, 560, 1120)  # that Gemma 4 was trained with


@dataclass(frozen=True, kw_only=True)
class PixelLimits:
    """Limits of a frame's area.

    Attributes:
        min_pixels: area that smaller frames are enlarged to; the checkpoint's setting where None.
        max_pixels: area that larger frames are reduced to; the checkpoint's setting where None.
    """

    min_pixels: int | None = None
    max_pixels: int | None = None

    def __post_init__(self) -> None:
        most = IMAGE_MEGAPIXELS.value * 1_000_000
        for name in ("min_pixels", "max_pixels"):
            value = getattr(self, name)
            if value is not None and not 1 <= value <= most:
                raise ValueError(f"{name}={value} is not between 1 and {most}")
        if (
            self.min_pixels is not None
            and self.max_pixels is not None
            and self.min_pixels > self.max_pixels
        ):
            raise ValueError(f"min_pixels={self.min_pixels} is above max_pixels={self.max_pixels}")
        super().__post_init__()  # type: ignore[misc]  # the options that it is mixed into have one

    def image_settings(self) -> dict[str, int]:
        """Return the image processor settings that differ from the checkpoint's."""
        limits = {"min_pixels": self.min_pixels, "max_pixels": self.max_pixels}
        return {name: value for name, value in limits.items() if value is not None}


@dataclass(frozen=True, kw_only=True)
class Qwen25VLOptions(PixelLimits, CheckpointOptions):
    """Options of `qwen2.5-vl`."""

    pretrained: str = "Qwen/Qwen2.5-VL-7B-Instruct"


@dataclass(frozen=True, kw_only=True)
class Qwen25VLNanoOptions(PixelLimits, CheckpointOptions):
    """Options of `qwen2.5-vl-nano`, whose checkpoint comes with the package."""

    pretrained: str = ""
    dtype: str = "float32"
    device: str = "cpu"
    threads: int | None = 1  # see `TinyOptions`


@dataclass(frozen=True, kw_only=True)
class LlavaOnevisionOptions(CheckpointOptions):
    """Options of `llava-onevision`."""

    pretrained: str = "llava-hf/llava-onevision-qwen2-7b-ov-hf"


@dataclass(frozen=True, kw_only=True)
class DeepseekVLOptions(CheckpointOptions):
    """Options of `deepseek-vl`."""

    pretrained: str = "deepseek-community/deepseek-vl-7b-chat"


@dataclass(frozen=True, kw_only=True)
class PixtralOptions(CheckpointOptions):
    """Options of `pixtral`."""

    pretrained: str = "mistral-community/pixtral-12b"


@dataclass(frozen=True, kw_only=True)
class HfVlmOptions(FrameScaling, CheckpointOptions):
    """Options of `hf-vlm`, which has no default checkpoint."""

    pretrained: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        CheckpointOptions.__post_init__(self)


@dataclass(frozen=True, kw_only=True)
class PixelVlmOptions(PixelLimits, HfVlmOptions):
    """Options of models that `hf-vlm` runs, whose frames have limits of their area."""


@dataclass(frozen=True, kw_only=True)
class Gemma4Options(HfVlmOptions):
    """Options of `gemma4`.

    Attributes:
        soft_tokens: most tokens of a frame: 70, 140, 280, 560 or 1120; the checkpoint's setting
            where None (280).
    """

    soft_tokens: int | None = None

    def __post_init__(self) -> None:
        if self.soft_tokens not in (None, *_SOFT_TOKENS):
            raise ValueError(
                f"soft_tokens={self.soft_tokens} is not {', '.join(map(str, _SOFT_TOKENS))}"
            )
        super().__post_init__()

    def image_settings(self) -> dict[str, Any]:
        """Return the image processor settings that differ from the checkpoint's."""
        return {} if self.soft_tokens is None else {"max_soft_tokens": self.soft_tokens}
