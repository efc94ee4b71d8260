"""How much of an object lies within the frame, by its box and the camera."""

import numpy as np
from numpy.typing import NDArray

from infthor_eval.thor.view import Box, Camera, Vector

_STEPS = np.linspace(-1.0, 1.0, 7)
# points of a box, in half its sides (n, 3)
_POINTS = np.stack(np.meshgrid(_STEPS, _STEPS, _STEPS, indexing="ij"), axis=-1).reshape(-1, 3)
_ON_TOP = _POINTS[:, 1] > 0.5


def shares_in_frame(box: Box, camera: Camera, width: int, height: int) -> tuple[float, float]:
    """Return the shares, 0 to 1, of a box and of its top that lie in a frame of some size (pixels).

    What hides the box does not count.
    """
    points = _POINTS * (_array(box.size) / 2) + _array(box.center) - _array(camera.position)
    turn, tilt = np.radians((camera.rotation, camera.horizon))
    ahead = points[:, 0] * np.sin(turn) + points[:, 2] * np.cos(turn)
    aside = points[:, 0] * np.cos(turn) - points[:, 2] * np.sin(turn)
    depth = ahead * np.cos(tilt) - points[:, 1] * np.sin(tilt)
    up = ahead * np.sin(tilt) + points[:, 1] * np.cos(tilt)
    reach = depth * np.tan(np.radians(camera.field_of_view) / 2)  # vertical; negative behind it
    inside = (np.abs(up) <= reach) & (np.abs(aside) <= reach * width / height)
    return round(float(inside.mean()), 2), round(float(inside[_ON_TOP].mean()), 2)


def _array(vector: Vector) -> NDArray[np.float64]:
    return np.array([vector.x, vector.y, vector.z])
