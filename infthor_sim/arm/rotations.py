"""Conversion of rotation matrices to and from an axis and an angle."""

import math

import numpy as np

from infthor_sim.geometry import Array

__all__ = ["axis_angle", "rotation"]


def axis_angle(turn: Array) -> tuple[Array, float]:
    """Return the unit axis (3,) and angle in degrees, 0 to 180, of a rotation (3, 3); the axis of
    none is x."""
    # The skew part is the axis times twice the sine. Near half a turn the sine vanishes and the
    # symmetric part, whose columns lie along the axis, gives it.
    skew = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine, cosine = float(np.linalg.norm(skew)), float(np.trace(turn)) - 1.0
    if sine > 1e-6:
        return skew / sine, math.degrees(math.atan2(sine, cosine))
    if cosine > 0:
        return np.array([1.0, 0.0, 0.0]), 0.0
    columns = turn + np.eye(3)
    column = columns[:, int(np.argmax(np.diag(columns)))]
    return column / np.linalg.norm(column), 180.0


def rotation(axis: Array, degrees: float) -> Array:
    """Return the rotation (3, 3) about a unit axis (3,), by Rodrigues' formula."""
    angle = math.radians(degrees)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    matrix: Array = np.eye(3) + math.sin(angle) * skew + (1.0 - math.cos(angle)) * skew @ skew
    return matrix
