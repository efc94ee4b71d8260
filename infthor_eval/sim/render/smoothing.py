"""Where a picture is jagged, and how its pixels are divided to smooth it; what both implementations share.

Only pixels at a jump of brightness are worked over. Four rays through such a pixel meet what the pixel and its
neighbours show, and nothing else: what no pixel near shows is not looked for, which makes this cheap.
"""

import numpy as np
from numpy.typing import NDArray

__all__ = ["AROUND", "PARTS", "jagged"]

_JUMP = 48  # of the three channels' sum of 765
PARTS = ((-0.125, -0.375), (0.375, -0.125), (-0.375, 0.125), (0.125, 0.375))
"""Where the rays go through a pixel, from its middle, as shares of its width and height."""
AROUND = ((0, 0), (0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1))
"""The pixel and its neighbours, as rows and columns from it."""


def jagged(rgb: NDArray[np.uint8]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows and columns of the pixels that differ much from a neighbour."""
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
