"""Light and shadow at creases and outlines, from depth alone, so that neighbours of one colour stand apart.

The inverse of depth is linear in the picture wherever a surface is flat, so how far a pixel's differs from the mean of
its neighbours' tells an outline or a crease from a slope.
"""

import numpy as np

from infthor_eval.sim.geometry import Array

__all__ = ["relief"]

_STRENGTH = 7.0
_DARKEST, _LIGHTEST = 0.68, 1.1
_REACH = 150  # the neighbours are one pixel away for every so many rows of the picture


def relief(depth: Array) -> Array:
    """Factors of brightness (h, w): below 1 behind an outline and in a crease, above 1 along an edge."""
    step = max(1, depth.shape[0] // _REACH)
    inverse = np.pad(1.0 / depth, step, mode="edge")
    around = inverse[: -2 * step, step:-step] + inverse[2 * step :, step:-step]
    around += inverse[step:-step, : -2 * step]
    around += inverse[step:-step, 2 * step :]
    around *= depth
    around -= 4.0
    around *= -_STRENGTH
    around += 1.0
    return np.clip(around, _DARKEST, _LIGHTEST, out=around)
