"""Light and shadow at creases and outlines, compiled by numba: the formulas of `creases`, in the
same order."""

import numpy as np
from numba import njit

from infthor_sim.geometry import Array
from infthor_sim.render.creases import DARKEST, LIGHTEST, ROWS, STRENGTH

__all__ = ["crease_factors"]


def crease_factors(depth: Array) -> Array:
    """Return factors of brightness (h, w), see `creases.crease_factors`."""
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
