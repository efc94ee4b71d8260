"""Subdivision of movements into the small steps at which collisions are checked."""

import math

import numpy as np

from infthor_sim.geometry import Array, axis_angle, axis_rotation

STEP = 0.02  # metres between two collision checks: Unity's usual speed of 1 m/s in frames of 1/50 s
# metres of a path that are checked by such steps; the arm is stretched out by then and hardly moves
_FINE = 1.0
_GROWTH = 1.1  # factor by which steps grow beyond


def shares(length: float, step: float) -> Array:
    """Return shares of a path at which to check it, at least its end, 1; same unit for both."""
    count = max(1, math.ceil(length / step - 1e-9))  # without the margin, rounding could add a step
    return np.arange(1, count + 1) / count


def path_distances(distance: float) -> Array:
    """Return metres at which to check a path, maybe longer than the arm; the last is its end."""
    if distance <= _FINE:
        return shares(distance, STEP) * distance
    fine = shares(_FINE, STEP) * _FINE
    count = math.ceil(math.log(distance / _FINE) / math.log(_GROWTH))
    return np.append(fine, np.minimum(_FINE * _GROWTH ** np.arange(1, count + 1), distance))


def rotation_steps(turn: Array, step: float) -> list[Array]:
    """Return rotations (3, 3) on the shortest way to `turn`, at most `step` degrees apart."""
    axis, angle = axis_angle(turn)
    # `turn` itself ends the list, as the last part of the way differs from it by rounding.
    return [*(axis_rotation(axis, angle * share) for share in shares(angle, step)[:-1]), turn]
