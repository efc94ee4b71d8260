"""Options of models with a name of their own that run as `hf-vlm` does.

The usual checkpoint of each is the one of its public documents that is nearest to eight billion
weights in use, as those of the paper are; of Mistral Small and Llama 4 it is the smallest. Image
sizes, system prompts, end tokens and penalties are those of a checkpoint's own files.
"""

from dataclasses import dataclass
from typing import Any

from model_adapters.options.families import HfVlmOptions, PixelLimits

__all__ = [
    "Gemma3Options",
    "Gemma4Options",
    "Glm46VOptions",
    "InternVL35Options",
    "Llama4Options",
    "MistralSmallOptions",
    "Molmo2Options",
    "Qwen3VLMoeOptions",
    "Qwen3VLOptions",
    "Qwen35Options",
    "SmolVLM2Options",
]

_SOFT_TOKENS = (70, 140, 280, 560, 1120)  # that Gemma 4 was trained with


@dataclass(frozen=True, kw_only=True)
class Qwen3VLOptions(PixelLimits, HfVlmOptions):
    """Options of `qwen3-vl`."""

    pretrained: str = "Qwen/Qwen3-VL-8B-Instruct"


@dataclass(frozen=True, kw_only=True)
class Qwen3VLMoeOptions(PixelLimits, HfVlmOptions):
    """Options of `qwen3-vl-moe`."""

    pretrained: str = "Qwen/Qwen3-VL-30B-A3B-Instruct"


@dataclass(frozen=True, kw_only=True)
class Qwen35Options(PixelLimits, HfVlmOptions):
    """Options of `qwen3.5`."""

    pretrained: str = "Qwen/Qwen3.5-9B"


@dataclass(frozen=True, kw_only=True)
class InternVL35Options(HfVlmOptions):
    """Options of `internvl3.5`; checkpoints of transformers' form end in `-HF`."""

    pretrained: str = "OpenGVLab/InternVL3_5-8B-HF"


@dataclass(frozen=True, kw_only=True)
class Gemma3Options(HfVlmOptions):
    """Options of `gemma3`."""

    pretrained: str = "google/gemma-3-12b-it"


@dataclass(frozen=True, kw_only=True)
class Gemma4Options(HfVlmOptions):
    """Options of `gemma4`.

    Attributes:
        soft_tokens: most tokens of a frame: 70, 140, 280, 560 or 1120; the checkpoint's setting
            where None (280).
    """

    pretrained: str = "google/gemma-4-E4B-it"
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


@dataclass(frozen=True, kw_only=True)
class SmolVLM2Options(HfVlmOptions):
    """Options of `smolvlm2`; with `image_splitting=false` a frame has a fraction of the tokens."""

    pretrained: str = "HuggingFaceTB/SmolVLM2-2.2B-Instruct"


@dataclass(frozen=True, kw_only=True)
class Glm46VOptions(HfVlmOptions):
    """Options of `glm-4.6v`."""

    pretrained: str = "zai-org/GLM-4.6V-Flash"


@dataclass(frozen=True, kw_only=True)
class MistralSmallOptions(HfVlmOptions):
    """Options of `mistral-small`; the checkpoint is the one of transformers' documents."""

    pretrained: str = "mistralai/Mistral-Small-3.1-24B-Instruct-2503"


@dataclass(frozen=True, kw_only=True)
class Llama4Options(HfVlmOptions):
    """Options of `llama4`."""

    pretrained: str = "meta-llama/Llama-4-Scout-17B-16E-Instruct"


@dataclass(frozen=True, kw_only=True)
class Molmo2Options(HfVlmOptions):
    """Options of `molmo2`, which cannot share prefixes: all its images are seen together."""

    pretrained: str = "allenai/Molmo2-8B"
    share_prefix: bool = False
