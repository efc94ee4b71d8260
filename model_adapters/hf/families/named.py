"""Models with a name of their own that run as `hf-vlm` does, without code for them.

To add a name for a model that `hf-vlm` runs: a class here, its options and usual checkpoint in
`model_adapters/options/named.py`, its line in `model_adapters/built_in.py` and in `docs/nieh.md`.
"""

from typing import ClassVar, TypeVar

from model_adapters.hf.adapter import require_model_type
from model_adapters.hf.families.hf_vlm import HfVlm
from model_adapters.hf.loading.checkpoint import LocatedCheckpoint
from model_adapters.options.checkpoints import CheckpointReading
from model_adapters.options.named import (
    Gemma3Options,
    Gemma4Options,
    Glm46VOptions,
    InternVL35Options,
    Llama4Options,
    MistralSmallOptions,
    Molmo2Options,
    Qwen3VLMoeOptions,
    Qwen3VLOptions,
    Qwen35Options,
    SmolVLM2Options,
)

__all__ = [
    "Gemma3",
    "Gemma4",
    "Glm46V",
    "InternVL35",
    "Llama4",
    "MistralSmall",
    "Molmo2",
    "NamedVlm",
    "Qwen3VL",
    "Qwen3VLMoe",
    "Qwen35",
    "SmolVLM2",
]

R = TypeVar("R", bound=CheckpointReading)


class NamedVlm(HfVlm):
    """Base of these adapters.

    Attributes:
        model_types: supported values of `model_type` in configs.
    """

    model_types: ClassVar[tuple[str, ...]]

    @classmethod
    def locate(cls, name: str, options: R) -> LocatedCheckpoint[R]:
        """Find a checkpoint of this model, for any engine.

        Raises:
            UsageError: no checkpoint is given.
            ModelError: the checkpoint does not exist, or is of another model.
        """
        located = super().locate(name, options)
        require_model_type(located, cls.model_types)
        return located


class Qwen3VL(NamedVlm):
    """The adapter `qwen3-vl`."""

    Options = Qwen3VLOptions
    model_types = ("qwen3_vl",)


class Qwen3VLMoe(NamedVlm):
    """The adapter `qwen3-vl-moe`."""

    Options = Qwen3VLMoeOptions
    model_types = ("qwen3_vl_moe",)


class Qwen35(NamedVlm):
    """The adapter `qwen3.5`."""

    Options = Qwen35Options
    model_types = ("qwen3_5", "qwen3_5_moe")


class InternVL35(NamedVlm):
    """The adapter `internvl3.5`."""

    Options = InternVL35Options
    model_types = ("internvl",)


class Gemma3(NamedVlm):
    """The adapter `gemma3`."""

    Options = Gemma3Options
    model_types = ("gemma3",)


class Gemma4(NamedVlm):
    """The adapter `gemma4`."""

    Options = Gemma4Options
    model_types = ("gemma4",)


class SmolVLM2(NamedVlm):
    """The adapter `smolvlm2`."""

    Options = SmolVLM2Options
    model_types = ("smolvlm",)


class Glm46V(NamedVlm):
    """The adapter `glm-4.6v`."""

    Options = Glm46VOptions
    model_types = ("glm4v", "glm4v_moe", "glm46v")


class MistralSmall(NamedVlm):
    """The adapter `mistral-small`."""

    Options = MistralSmallOptions
    model_types = ("mistral3",)


class Llama4(NamedVlm):
    """The adapter `llama4`."""

    Options = Llama4Options
    model_types = ("llama4",)


class Molmo2(NamedVlm):
    """The adapter `molmo2`."""

    Options = Molmo2Options
    model_types = ("molmo2",)
