"""Anti-aliasing: which pixels are jagged, and the rays that smooth them; shared by both implementations.

Only pixels at a jump of brightness are smoothed. Four rays through such a pixel are tested against the primitives that
the pixel and its neighbours show, and no others. That misses what no pixel near shows, but costs little.
"""

import numpy as np
from numpy.typing import NDArray

__all__ = ["NEIGHBOURS", "SUBPIXELS", "find_jagged"]

_JUMP = 48  # of brightness between neighbours, as the sum of three channels (of 765)
# A rotated grid: no two rays share a row or column, so that nearly level and nearly upright edges get all four steps.
SUBPIXELS = ((-0.125, -0.375), (0.375, -0.125), (-0.375, 0.125), (0.125, 0.375))
"""Points of a pixel that the rays go through, from its middle, as shares of its width and height."""
NEIGHBOURS = ((0, 0), (0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1))
"""The pixel and its neighbours, as offsets of row and column."""


def find_jagged(rgb: NDArray[np.uint8]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows and columns of the pixels that differ much from a neighbour."""
    # int16 holds sums up to 765 and their differences, in a quarter of the memory of numpy's default.
    total = np.add(rgb[:, :, 0], rgb[:, :, 1], dtype=np.int16)
    total += rgb[:, :, 2]
    marked = np.zeros(total.shape, dtype=bool)
    down = np.abs(total[1:] - total[:-1]) > _JUMP
    across = np.abs(total[:, 1:] - total[:, :-1]) > _JUMP
    marked[1:] |= down
    marked[:-1] |= down
    marked[:, 1:] |= across
    marked[:, :-1] |= across
    ys, xs = np.nonzero(marked)
    return ys, xs
