"""Cutting of replies at stop strings."""

from collections.abc import Sequence

__all__ = ["cut_at_stop"]


def cut_at_stop(text: str, stop: Sequence[str]) -> str | None:
    """Return the text before its first stop string, or None if it holds none."""
    positions = [text.index(string) for string in stop if string in text]
    return text[: min(positions)] if positions else None
