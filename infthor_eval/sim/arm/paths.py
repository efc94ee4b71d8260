"""Paths of small steps for the arm and for the agent that carries it."""

import math

import numpy as np

from infthor_eval.sim.arm.turns import axis_angle, rotation
from infthor_eval.sim.geometry import Array

__all__ = ["STEP", "away_steps", "shares", "turning"]

STEP = 0.02  # metres from one look at what is in the way to the next, as Unity's usual speed and frame have it
_GROWTH, _FINE = 1.1, 1.0  # beyond so many metres steps grow: the arm is stretched out by then


def shares(length: float, step: float) -> Array:
    """Where along a path of some length (metres or degrees) to look, as shares of it; its end at least."""
    count = max(1, math.ceil(length / step - 1e-9))
    return np.arange(1, count + 1) / count


def away_steps(distance: float) -> Array:
    """Distances at which to look on a way of some length that may be much longer than an arm, metres."""
    if distance <= _FINE:
        return shares(distance, STEP) * distance
    fine = shares(_FINE, STEP) * _FINE
    count = math.ceil(math.log(distance / _FINE) / math.log(_GROWTH))
    return np.append(fine, np.minimum(_FINE * _GROWTH ** np.arange(1, count + 1), distance))


def turning(turn: Array, step: float) -> list[Array]:
    """Rotations (3, 3) on the shortest way from none to `turn`, at most `step` degrees from one to the next."""
    axis, angle = axis_angle(turn)
    return [*(rotation(axis, angle * share) for share in shares(angle, step)[:-1]), turn]
