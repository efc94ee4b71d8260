"""What the model sees and how it answers; nothing here knows of infthor-eval."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from PIL import Image

__all__ = ["Thumbnail", "answer", "thumbnail"]

Thumbnail = NDArray[np.float64]  # (side, side, 3), 0 to 255

_YES_OR_NO = ("is ", "are ", "was ", "were ", "have ", "did ")
_COLOURS = {
    "black": (0, 0, 0),
    "white": (255, 255, 255),
    "grey": (128, 128, 128),
    "brown": (120, 80, 50),
    "red": (200, 40, 40),
    "green": (50, 140, 60),
    "blue": (50, 80, 180),
    "yellow": (220, 200, 70),
}
_CHANGE = 12.0  # mean difference of two thumbnails that show different things
_CONTRAST = 40.0  # spread of a thumbnail that shows something before its background


def thumbnail(frame: Image.Image, side: int) -> Thumbnail:
    """The mean colours of a frame's fields, (side, side, 3)."""
    return np.asarray(frame.resize((side, side), Image.Resampling.BOX), dtype=np.float64)


def answer(prompt: str, seen: Sequence[Thumbnail]) -> str:
    """A word from some thumbnails in time order; a number, yes or no, or a colour, as the question
    wants it."""
    question = prompt.rpartition("Question:")[2].strip().lower()
    if not seen:
        return "nothing"
    if question.startswith("how many"):
        changes = [np.abs(one - other).mean() > _CHANGE for one, other in pairwise(seen)]
        return str(1 + sum(changes))
    if question.startswith(_YES_OR_NO):
        return "yes" if seen[-1].mean(axis=2).std() > _CONTRAST else "no"
    mean = seen[-1].mean(axis=(0, 1))
    return min(_COLOURS, key=lambda name: float(np.abs(mean - _COLOURS[name]).sum()))
