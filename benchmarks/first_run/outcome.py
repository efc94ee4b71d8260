"""What a step found."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

__all__ = ["Outcome"]


@dataclass(frozen=True)
class Outcome:
    """What a step found.

    Attributes:
        measured: in words.
        right: whether it is as expected; None where numbers are to be read and compared.
        figures: numbers that a later step needs, as JSON values.
    """

    measured: str
    right: bool | None = None
    figures: Mapping[str, Any] = field(default_factory=dict)
