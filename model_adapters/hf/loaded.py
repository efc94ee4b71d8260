"""A checkpoint in memory, wherever it came from."""

from dataclasses import dataclass
from typing import Any

from model_adapters.hf.decoding import Generation
from model_adapters.hf.family import Family

__all__ = ["Loaded"]


@dataclass(frozen=True)
class Loaded:
    """All that is needed to run a model.

    Attributes:
        model: the transformers model, in evaluation mode.
        tokenizer: its tokenizer.
        image_processor: its image processor.
        template: what writes a conversation (Jinja): its chat template, or a plain one.
        family: how its frames become tokens, features and positions.
        generation: end tokens and penalties.
        max_tokens: its context limit; None where the config names none.
        identity: what distinguishes it from other checkpoints, as JSON values.
    """

    model: Any
    tokenizer: Any
    image_processor: Any
    template: str
    family: Family
    generation: Generation
    max_tokens: int | None
    identity: dict[str, Any]
