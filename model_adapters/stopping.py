"""Where a stop string ends a reply."""

from collections.abc import Sequence

__all__ = ["cut_at_stop"]


def cut_at_stop(text: str, stop: Sequence[str]) -> str | None:
    """The text before the first stop string in it, or None where there is none."""
    found = [text.index(string) for string in stop if string in text]
    return text[: min(found)] if found else None
