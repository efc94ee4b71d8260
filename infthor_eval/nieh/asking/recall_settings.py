"""How a memory recalls what a sample shows."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from infthor_eval.memory import MemoryOptions

__all__ = ["RecallSettings"]


@dataclass(frozen=True)
class RecallSettings:
    """How a memory recalls what a sample shows.

    Attributes:
        memory: name of the memory, or FILE.py:CLASS.
        options: options of its class, sorted pairs.
        budget: most tokens of what is recalled; None for the memory's own limit.
        tokens_per_frame: tokens of a frame for the model under test; None if there is no budget.
        seed: seed of what the memory draws.
    """

    memory: str
    options: MemoryOptions = ()
    budget: int | None = None
    tokens_per_frame: int | None = None
    seed: int = 0

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> "RecallSettings":
        """Return the settings of a mapping of their fields."""
        return cls(**{**document, "options": tuple(sorted(dict(document["options"]).items()))})
