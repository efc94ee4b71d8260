"""Models that are people: what they are told beside the conversation."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from model_adapters.protocols import Model

__all__ = ["Attended", "Notice"]


@dataclass(frozen=True, kw_only=True)
class Notice:
    """What a person is told beside the conversation, which models are not.

    Attributes:
        title: heading of what is asked.
        facts: names and values, in order.
        news: what became of the last reply; empty if there is nothing to say.
        words: words that complete what is typed.
        replies: replies that are possible now, as buttons; others are possible too, unless the
            decoding has choices.
    """

    title: str = ""
    facts: tuple[tuple[str, str], ...] = ()
    news: str = ""
    words: tuple[str, ...] = ()
    replies: tuple[str, ...] = ()


@runtime_checkable
class Attended(Model, Protocol):
    """A model that is a person at a page."""

    def tell(self, notice: Notice) -> None:
        """Take what is to be shown with the next request, and with those after it until the next
        notice."""
