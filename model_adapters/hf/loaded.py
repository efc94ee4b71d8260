"""A checkpoint in memory."""

from dataclasses import dataclass
from typing import Any

from model_adapters.hf.decoding import Generation
from model_adapters.hf.family import Family

__all__ = ["LoadedCheckpoint"]


@dataclass(frozen=True)
class LoadedCheckpoint:
    """A model with everything that is needed to run it.

    Attributes:
        model: the transformers model, in evaluation mode.
        tokenizer: tokenizer of the model.
        image_processor: image processor of the model.
        template: template of conversations (Jinja): the checkpoint's chat template, or a plain one.
        family: family of the model.
        generation: end tokens and penalties.
        max_tokens: context limit, or None if the config has none.
        identity: what distinguishes this checkpoint from others, as JSON values.
    """

    model: Any
    tokenizer: Any
    image_processor: Any
    template: str
    family: Family
    generation: Generation
    max_tokens: int | None
    identity: dict[str, Any]
