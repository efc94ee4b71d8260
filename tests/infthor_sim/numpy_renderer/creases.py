"""Light and shadow at creases and outlines, in numpy."""

import numpy as np

from infthor_sim.geometry import Array
from infthor_sim.render.creases_numba import DARKEST, LIGHTEST, ROWS, STRENGTH

__all__ = ["crease_factors"]


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
