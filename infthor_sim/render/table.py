"""All that the colours of a picture depend on, in one array.

Numba counts references to each array that an inlined function takes, at every call: two arrays more
for each pixel cost as much as its light. So primitives, their place in the camera's view, and the
lamps go into the kernels as one table.
"""

import numpy as np

from infthor_sim.geometry import Array
from infthor_sim.render.camera import Projection
from infthor_sim.render.lighting import SUN_DIRECTION, Lights
from infthor_sim.render.primitives import AXES, COLUMNS, HALF

INVERSE = COLUMNS  # inverse half extents
SUNWARD = INVERSE + 3  # cosines between the primitive's axes and the sun
ORIGIN = SUNWARD + 3  # the camera in the primitive's scaled frame
STEPS = ORIGIN + 3  # the camera's forward, right and up vectors there, one after the other
_WIDTH = STEPS + 9


def shading_table(prims: Array, projection: Projection, lights: Lights) -> Array:
    """Return the projected primitives, and below them the lamps (n + m, columns).

    A primitive's row begins as in `prims`; a lamp's has its position and strength in the first four
    columns.
    """
    n = len(projection.index)
    table = np.zeros((n + len(lights.lamps), _WIDTH))
    table[:n, :COLUMNS] = prims[projection.index]
    table[:n, INVERSE:SUNWARD] = 1.0 / table[:n, HALF : HALF + 3]
    table[:n, SUNWARD:ORIGIN] = table[:n, AXES : AXES + 9].reshape(-1, 3, 3) @ np.array(
        SUN_DIRECTION
    )
    table[:n, ORIGIN:STEPS] = projection.origin
    table[:n, STEPS:] = projection.steps.reshape(-1, 9)
    table[n:, :4] = lights.lamps
    return table
