"""Light and shadow at creases and outlines, from depth alone; compiled by numba.

They tell neighbours of one colour apart. The inverse of depth is linear in the picture wherever a
surface is flat, so how far a pixel's differs from the mean of its neighbours' shows creases and
outlines, and not slopes.
"""

import numpy as np
from numba import njit

from infthor_sim.geometry import Array

STRENGTH = 7.0
DARKEST = 0.68
LIGHTEST = 1.1
# of the picture for each pixel to the neighbours: shadows are as wide in pictures of any size
ROWS = 150


def crease_factors(depth: Array) -> Array:
    """Return factors of brightness (h, w) of depths (h, w).

    They are below 1 behind an outline and in a crease, and above 1 along an edge.
    """
    factors = np.empty(depth.shape)
    _crease_factors(1.0 / depth, depth, max(1, depth.shape[0] // ROWS), factors)
    return factors


@njit(cache=True, error_model="numpy")
def _crease_factors(inverse: Array, depth: Array, step: int, factors: Array) -> None:
    height, width = depth.shape
    for y in range(height):
        above = max(y - step, 0)
        below = min(y + step, height - 1)
        for x in range(step):
            left, right = max(x - step, 0), min(x + step, width - 1)
            around = ((inverse[above, x] + inverse[below, x]) + inverse[y, left]) + inverse[
                y, right
            ]
            factors[y, x] = min(
                max((around * depth[y, x] - 4.0) * -STRENGTH + 1.0, DARKEST), LIGHTEST
            )
        # The pixels between the margins, without a test for each.
        for x in range(step, width - step):
            around = ((inverse[above, x] + inverse[below, x]) + inverse[y, x - step]) + inverse[
                y, x + step
            ]
            factors[y, x] = min(
                max((around * depth[y, x] - 4.0) * -STRENGTH + 1.0, DARKEST), LIGHTEST
            )
        for x in range(max(step, width - step), width):
            left, right = max(x - step, 0), min(x + step, width - 1)
            around = ((inverse[above, x] + inverse[below, x]) + inverse[y, left]) + inverse[
                y, right
            ]
            factors[y, x] = min(
                max((around * depth[y, x] - 4.0) * -STRENGTH + 1.0, DARKEST), LIGHTEST
            )
