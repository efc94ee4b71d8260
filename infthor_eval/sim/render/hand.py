"""The held object in the agent's own frame: whole, low and small, so that it hides little of the room.

Only the picture is arranged so. In the world, for the metadata and for collisions, the object is somewhere else.
"""

import math

import numpy as np

from infthor_eval.sim.geometry import Array, euler_matrix
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.render.camera import PinholeCamera
from infthor_eval.sim.render.primitives import AXES, CENTER, HALF

__all__ = ["held_rows"]

_AWAY = 0.16  # metres in front of the camera: nearer than anything that the agent can stand in front of
_LOW = 0.74  # below the middle of the picture, as a share of its half height
_SMALLEST, _GROWTH, _LARGEST = 0.13, 0.3, 0.25  # shares of the picture's height: at least, per metre of size, at most
_TILT = euler_matrix((-24.0, 0.0, 0.0))  # towards the camera, which so sees into bowls and the faces of flat things
_TURN = 155.0  # degrees: the front, as of screens and clocks, faces the camera and a little aside


def held_rows(rows: Array, item: SimObject, camera: PinholeCamera) -> Array:
    """Return the primitives (n, COLUMNS) of `item` and its contents, moved to where the picture shows them."""
    spread = 2 * math.tan(math.radians(camera.field_of_view) / 2)
    size = float(np.max(item.box_size))
    scale = min(_SMALLEST + _GROWTH * size, _LARGEST) * spread * _AWAY / size
    at = camera.position + camera.matrix @ np.array([0.0, -_LOW * spread / 2 * _AWAY, _AWAY])
    upright = camera.matrix @ _TILT @ euler_matrix((0.0, _TURN + item.front, 0.0)) @ item.matrix.T
    shown = rows.copy()
    shown[:, CENTER : CENTER + 3] = at + scale * (rows[:, CENTER : CENTER + 3] - item.center) @ upright.T
    shown[:, HALF : HALF + 3] *= scale
    axes = rows[:, AXES : AXES + 9].reshape(-1, 3, 3)
    shown[:, AXES : AXES + 9] = (axes @ upright.T).reshape(-1, 9)
    return shown
