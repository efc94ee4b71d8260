"""Where an arm and what it holds would be in poses that it has not taken: measured off the one that it has."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from infthor_eval.manipulation.geometry import middle_of, point_of, size_of
from infthor_eval.thor.view import ArmState, AxisAngle, ThorObject

__all__ = ["Array", "Linkage", "Parts", "Poses", "angles_of", "heading", "turned"]

Array = NDArray[np.float64]
_UP: Array = np.array([0.0, 1.0, 0.0])
_THICK = 0.045  # metres: half the thickness of links and palm, a little more than they have
_STRETCHED = 0.995  # share of the arm's length that is used: a stretched arm's elbow has no side
_TINY = 1e-6


@dataclass(frozen=True)
class Poses:
    """Some poses (n) of an arm: three things that its three kinds of movement change one at a time.

    Attributes:
        wrists: where the wrist is, metres of the world (n, 3), but its height is that above the arm's base.
        bases: heights of the base in the world, metres (n,).
        turns: rotations of the hand in the world (n, 3, 3).
    """

    wrists: Array
    bases: Array
    turns: Array

    def __len__(self) -> int:
        return len(self.bases)

    def __getitem__(self, chosen: slice | NDArray[np.int64] | NDArray[np.bool_]) -> "Poses":
        return Poses(self.wrists[chosen], self.bases[chosen], self.turns[chosen])

    def world(self) -> Array:
        """Where the wrist is in the world, metres (n, 3)."""
        return self.wrists + self.bases[:, None] * _UP

    @staticmethod
    def join(several: "list[Poses]") -> "Poses":
        """All of some collections, in order."""
        wrists, bases, turns = ([getattr(s, name) for s in several] for name in ("wrists", "bases", "turns"))
        return Poses(np.concatenate(wrists), np.concatenate(bases), np.concatenate(turns))


@dataclass(frozen=True)
class Parts:
    """Turned boxes (n, m) of an arm's links, its palm and what it holds, which is the last.

    Attributes:
        center: metres (n, m, 3).
        axes: unit axes, one a row (n, m, 3, 3).
        half: half extents along them, metres (n, m, 3).
    """

    center: Array
    axes: Array
    half: Array


class Linkage:
    """An arm of two links that moves up and down, and whose hand turns freely.

    Attributes:
        now: the pose that it was measured in (1).
        lever: from the wrist to the middle of what is held, in the frame of the hand, metres (3,).
    """

    now: Poses
    lever: Array
    _lengths: tuple[float, float]
    _side: tuple[float, float]
    _held_axes: Array
    _held_half: Array

    def __init__(self, arm: ArmState, held: ThorObject, before: "Linkage | None" = None) -> None:
        """Measure an arm and what it holds.

        Args:
            arm: its state.
            held: what it holds; of that it is known how large it is along the world's axes.
            before: what was measured in another pose; the shapes are those of then, which are better known if the arm
                was bent and the hand level.
        """
        base, shoulder, elbow, wrist = (np.array(point_of(joint.position)) for joint in arm.joints)
        self._shoulder: Array = shoulder - base[1] * _UP
        self._foot: Array = base - base[1] * _UP
        turn = _matrix(arm.joints[-1].rotation)
        self.now = Poses((wrist - base[1] * _UP)[None], np.array([base[1]]), turn[None])
        if before is not None:
            self._lengths, self._side = before._lengths, before._side
            self.lever, self._held_axes, self._held_half = before.lever, before._held_axes, before._held_half
            return
        self._lengths = float(np.linalg.norm(elbow - shoulder)), float(np.linalg.norm(wrist - elbow))
        self._side = _elbow_side(elbow - shoulder, wrist - shoulder)
        self.lever = turn.T @ (np.array(middle_of(held)) - wrist)
        self._held_axes = turn
        self._held_half = np.array(size_of(held)) / 2

    def reached(self, poses: Poses) -> NDArray[np.bool_]:
        """Whether the arm reaches the wrist of each pose (n,)."""
        near: NDArray[np.bool_] = np.linalg.norm(poses.wrists - self._shoulder, axis=1) <= self.reach
        return near

    @property
    def reach(self) -> float:
        """Metres from the shoulder to which the wrist is sent."""
        return sum(self._lengths) * _STRETCHED

    @property
    def shoulder(self) -> Array:
        """The shoulder in the world but above the base, metres (3,)."""
        return self._shoulder

    def held(self, poses: Poses) -> Parts:
        """The box of what is held (n, 1)."""
        center = poses.world() + poses.turns @ self.lever
        axes = self._held_axes @ poses.turns.transpose(0, 2, 1)
        return Parts(center[:, None], axes[:, None], np.broadcast_to(self._held_half, (len(poses), 1, 3)))

    def parts(self, poses: Poses) -> Parts:
        """All boxes (n, 5): base, upper arm, forearm, palm, and what is held."""
        elbows = self._elbows(poses.wrists)
        foot, shoulder = (np.broadcast_to(point, elbows.shape) for point in (self._foot, self._shoulder))
        rods = [_rod(foot, shoulder), _rod(shoulder, elbows), _rod(elbows, poses.wrists)]
        palm = Parts(
            poses.wrists[:, None], poses.turns.transpose(0, 2, 1)[:, None], np.full((len(poses), 1, 3), _THICK)
        )
        lifted = [Parts(p.center + (poses.bases[:, None] * _UP)[:, None], p.axes, p.half) for p in (*rods, palm)]
        every = [*lifted, self.held(poses)]
        return Parts(
            *(np.concatenate([getattr(p, name) for p in every], axis=1) for name in ("center", "axes", "half"))
        )

    def _elbows(self, wrists: Array) -> Array:
        line = wrists - self._shoulder
        far = np.clip(np.linalg.norm(line, axis=1), _TINY, sum(self._lengths))
        upper, fore = self._lengths
        along = np.clip((far**2 + upper**2 - fore**2) / (2 * far), -upper, upper)
        over, aside = _across(line)
        out = self._side[0] * over + self._side[1] * aside
        elbows: Array = self._shoulder + (along / far)[:, None] * line + np.sqrt(upper**2 - along**2)[:, None] * out
        return elbows


def _across(lines: Array) -> tuple[Array, Array]:
    """Unit vectors (n, 3) above and to the side of some lines (n, 3)."""
    x, y, z = (lines / np.maximum(np.linalg.norm(lines, axis=1, keepdims=True), _TINY)).T
    level = np.maximum(np.hypot(x, z), _TINY)
    x, z = x / level, z / level
    nothing = np.zeros_like(x)
    return np.stack([-x * y, level, -z * y], axis=1), np.stack([z, nothing, -x], axis=1)


def _elbow_side(upper: Array, line: Array) -> tuple[float, float]:
    """Which way an elbow is out of the line from shoulder to wrist: how much above it and to its side."""
    over, aside = _across(line[None])
    out = float(over[0] @ upper), float(aside[0] @ upper)
    length = math.hypot(*out)
    return (1.0, 0.0) if length < _TINY else (out[0] / length, out[1] / length)


def _rod(start: Array, end: Array) -> Parts:
    """Boxes (n, 1) along links."""
    line = end - start
    length = np.linalg.norm(line, axis=1)
    over, aside = _across(line)
    axes = np.stack([aside, over, line / np.maximum(length, _TINY)[:, None]], axis=1)
    half = np.stack([np.full(len(line), _THICK), np.full(len(line), _THICK), length / 2], axis=1)
    return Parts(((start + end) / 2)[:, None], axes[:, None], half[:, None])


def _matrix(rotation: AxisAngle) -> Array:
    axis = np.array([rotation.x, rotation.y, rotation.z])
    return turned(axis, np.array([math.radians(rotation.w)]))[0]


def turned(axis: Array, angles: Array) -> Array:
    """Rotations (n, 3, 3) about a unit axis by angles (n,) in radians."""
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    made: Array = (
        np.eye(3) + np.sin(angles)[:, None, None] * skew + (1.0 - np.cos(angles))[:, None, None] * (skew @ skew)
    )
    return made


def heading(yaws: Array, pitches: Array) -> Array:
    """Rotations (n, 3, 3) of hands that look to a yaw (n,) and down by a pitch (n,), radians."""
    return turned(_UP, yaws) @ turned(np.array([1.0, 0.0, 0.0]), pitches)


def angles_of(turn: Array) -> tuple[float, float, float]:
    """Pitch, yaw and roll in degrees, as `RotateWristRelative` takes them, of a rotation (3, 3)."""
    pitch = math.asin(float(np.clip(-turn[1, 2], -1.0, 1.0)))
    yaw = math.atan2(turn[0, 2], turn[2, 2])
    roll = math.atan2(turn[1, 0], turn[1, 1])
    return math.degrees(pitch), math.degrees(yaw), -math.degrees(roll)
