"""Light and shadow at creases and outlines, from depth alone, so that neighbours of one colour can
be told apart.

The inverse of depth is linear in the picture wherever a surface is flat. How far a pixel's differs
from the mean of its neighbours' therefore shows creases and outlines, and not slopes.
"""

import numpy as np

from infthor_sim.geometry import Array

__all__ = ["DARKEST", "LIGHTEST", "ROWS", "STRENGTH", "crease_factors"]

STRENGTH = 7.0
DARKEST = 0.68
LIGHTEST = 1.1
# of the picture for each pixel to the neighbours: shadows are as wide in pictures of any size
ROWS = 150


def crease_factors(depth: Array) -> Array:
    """Return factors of brightness (h, w): below 1 behind an outline and in a crease, above 1 along
    an edge."""
    step = max(1, depth.shape[0] // ROWS)
    # In place where possible: temporaries of a whole picture cost more than the sums.
    inverse = np.pad(1.0 / depth, step, mode="edge")
    around = inverse[: -2 * step, step:-step] + inverse[2 * step :, step:-step]
    around += inverse[step:-step, : -2 * step]
    around += inverse[step:-step, 2 * step :]
    around *= depth
    around -= 4.0
    around *= -STRENGTH
    around += 1.0
    return np.clip(around, DARKEST, LIGHTEST, out=around)
