"""Prompts of texts and frames as one text."""

from collections.abc import Iterable

from model_adapters import Part

__all__ = ["join_parts"]


def join_parts(parts: Iterable[Part]) -> str:
    """The parts in a row, with `<image>` for a frame."""
    return "".join(part if isinstance(part, str) else "<image>" for part in parts)
