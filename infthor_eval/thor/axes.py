"""Object axes of AI2-THOR 2.1.0 and 5.x: some long objects are turned by 90 or 270 degrees in 5.x.

So rotations recorded in 2.1.0 (ALFRED, the published trajectories) need a turn about the object's
own vertical axis. The turns below are those that fit the boxes recorded in ALFRED's training
trajectories best.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

_ACROSS = ("ButterKnife", "Fork", "Knife", "Ladle", "Pen", "Pencil", "Spoon", "SprayBottle")
_TURNS = {**dict.fromkeys(_ACROSS, 90.0), "Spatula": 270.0}  # degrees


def modern_rotation(object_type: str, rotation: Mapping[str, float]) -> dict[str, float]:
    """Convert Euler angles of 2.1.0 (Unity's x, y, z, degrees) to those of the same look in 5.x."""
    turn = _TURNS.get(object_type, 0.0)
    if not turn:
        return dict(rotation)
    return _angles(_matrix(rotation) @ _matrix({"x": 0.0, "y": turn, "z": 0.0}))


def _matrix(rotation: Mapping[str, float]) -> NDArray[np.float64]:
    """Return the rotation matrix of Unity's Euler angles: about z first, then x, then y."""
    x, y, z = [math.radians(rotation[axis]) for axis in "xyz"]
    about_x = np.array([[1, 0, 0], [0, math.cos(x), -math.sin(x)], [0, math.sin(x), math.cos(x)]])
    about_y = np.array([[math.cos(y), 0, math.sin(y)], [0, 1, 0], [-math.sin(y), 0, math.cos(y)]])
    about_z = np.array([[math.cos(z), -math.sin(z), 0], [math.sin(z), math.cos(z), 0], [0, 0, 1]])
    product: NDArray[np.float64] = about_y @ about_x @ about_z
    return product


def _angles(matrix: NDArray[np.float64]) -> dict[str, float]:
    x = math.asin(max(-1.0, min(1.0, -matrix[1, 2])))
    if abs(matrix[1, 2]) > 1 - 1e-9:  # gimbal lock: y and z turn about the same axis, so z can be 0
        y = math.atan2(-matrix[2, 0], matrix[0, 0])
        z = 0.0
    else:
        y = math.atan2(matrix[0, 2], matrix[2, 2])
        z = math.atan2(matrix[1, 0], matrix[1, 1])
    return {
        axis: round(math.degrees(angle) % 360, 6)
        for axis, angle in zip("xyz", (x, y, z), strict=True)
    }
