"""How unlike two pictures are, and whether an eye can tell them apart."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.step_log import ObjectInFrame
from infthor_eval.generation.questions.history import DEFAULT_SHARE

# Two objects that change places are two outlines, each as large as what counts as shown. Below
# this, by eye, a pair differs in the edge of a door or of a plate.
_CLEAR_SHARE = 2 * DEFAULT_SHARE
_CLEAR_LEVEL = 24  # of 255; shadows and highlights beside an object differ by less
_CLEAR_PART = 0.1  # of an object's pixels


def channel_differences(one: Path, other: Path) -> npt.NDArray[np.int64]:
    """Return how far two pictures of the same size are apart.

    Args:
        one: file of a picture.
        other: file of another.

    Returns:
        Differences of 0 to 255, of shape (height, width, 3).
    """
    first, second = (np.asarray(FrameRef(path).load(), np.int64) for path in (one, other))
    return np.abs(first - second)


def are_clearly_unlike(one: Path, other: Path, of: Sequence[ObjectInFrame] = ()) -> bool:
    """Return True if an eye can tell two pictures of the same size apart.

    Args:
        one: file of a picture.
        other: file of another.
        of: how each picture shows the objects that are asked about. If there are any, a tenth of
            the pixels that show one must differ, too: the edge of an open door is not enough where
            something else differs more.
    """
    differ = channel_differences(one, other).max(axis=-1) > _CLEAR_LEVEL
    if differ.mean() < _CLEAR_SHARE:
        return False
    within = np.zeros_like(differ)
    for seen in of:
        left, top, right, bottom = seen.box
        within[top : bottom + 1, left : right + 1] = True
    least = _CLEAR_PART * max((seen.pixels for seen in of), default=0)
    return bool((differ & within).sum() >= least)
