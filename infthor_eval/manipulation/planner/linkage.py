"""Forward kinematics of an arm: where its parts and the held object would be in other poses.

Lengths and offsets are measured in the present pose, as the simulators' metadata have joints but no
dimensions.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from infthor_eval.manipulation.geometry import middle_of, point_of, size_of
from infthor_eval.thor.view import AgentPose, ArmState, AxisAngle, ThorObject

Array = NDArray[np.float64]
_UP: Array = np.array([0.0, 1.0, 0.0])
_THICK = 0.045  # metres: half the thickness of links and palm, a little more than the actual one
# share of the arm's length that is used: the elbow of a fully stretched arm has no defined side
_STRETCHED = 0.995
_TINY = 1e-6
_FLOOR = 0.9  # metres from the agent's position down to the floor
_RANGE = 0.451, 1.801  # metres: heights of the arm's base above the floor


@dataclass(frozen=True)
class ArmStand:
    """Where an agent stands: heights of its arm's base (metres) and its direction (radians)."""

    low: float
    high: float
    heading: float

    @classmethod
    def of(cls, agent: AgentPose) -> "ArmStand":
        """Return the stand of an agent; AI2-THOR's agents with an arm all have one height."""
        floor = agent.position.y - _FLOOR
        return cls(floor + _RANGE[0], floor + _RANGE[1], math.radians(agent.rotation))

    @property
    def floor(self) -> float:
        """Height of the floor, metres."""
        return self.low - _RANGE[0]

    def share(self, base: float) -> float:
        """Return a height of the base as `MoveArmBase` takes it, from 0 to 1."""
        return min(1.0, max(0.0, (base - self.low) / (self.high - self.low)))


@dataclass(frozen=True)
class Poses:
    """Poses (n) of an arm.

    They are in coordinates that each of AI2-THOR's movements changes one of: `MoveArmBase` carries
    the wrist along, so its height is relative to the base.

    Attributes:
        wrists: positions of the wrist, metres of the world (n, 3), but with the height above the
            arm's base.
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
        """Return the positions of the wrist in the world, metres (n, 3)."""
        return self.wrists + self.bases[:, None] * _UP

    @staticmethod
    def join(several: "list[Poses]") -> "Poses":
        """Concatenate poses."""
        parts = zip(*((poses.wrists, poses.bases, poses.turns) for poses in several), strict=True)
        return Poses(*map(np.concatenate, parts))


@dataclass(frozen=True)
class Parts:
    """Oriented boxes (n, m) of an arm's links, its palm and the held object, which is the last.

    Attributes:
        center: centres, metres (n, m, 3).
        axes: unit axes, one a row (n, m, 3, 3).
        half: half extents along them, metres (n, m, 3).
    """

    center: Array
    axes: Array
    half: Array

    @staticmethod
    def join(several: "list[Parts]") -> "Parts":
        """Concatenate boxes (n, *) of the same poses."""
        return Parts(
            np.concatenate([parts.center for parts in several], axis=1),
            np.concatenate([parts.axes for parts in several], axis=1),
            np.concatenate([parts.half for parts in several], axis=1),
        )


class Linkage:
    """An arm of two links that moves up and down, and whose hand turns freely.

    Attributes:
        now: the pose that it was measured in (1).
        shoulder: position of the shoulder in the world, with the height above the base, metres
            (3,).
        lever: vector from the wrist to the middle of the held object, in the frame of the hand,
            metres (3,).
    """

    now: Poses
    lever: Array
    _lengths: tuple[float, float]
    _side: tuple[float, float]
    _held_axes: Array
    _held_half: Array

    def __init__(self, arm: ArmState, held: ThorObject, before: "Linkage | None" = None) -> None:
        """Measure an arm and the object that it holds.

        Args:
            held: the held object; its box is along the world's axes, so it grows when the hand is
                tilted.
            before: measurements in another pose, whose shapes are taken over. Those of the first
                pose are the best: the arm is bent, which tells the side of the elbow, and the hand
                is level, so the object's box is tight.
        """
        joints = [np.array(point_of(joint.position)) for joint in arm.joints]
        base, shoulder, elbow, wrist = joints
        self.shoulder: Array = shoulder - base[1] * _UP
        self._foot: Array = base - base[1] * _UP
        turn = _matrix(arm.joints[-1].rotation)
        self.now = Poses((wrist - base[1] * _UP)[None], np.array([base[1]]), turn[None])
        if before is not None:
            self._lengths = before._lengths
            self._side = before._side
            self.lever = before.lever
            self._held_axes = before._held_axes
            self._held_half = before._held_half
            return
        self._lengths = (
            float(np.linalg.norm(elbow - shoulder)),
            float(np.linalg.norm(wrist - elbow)),
        )
        self._side = _elbow_side(elbow - shoulder, wrist - shoulder)
        self.lever = turn.T @ (np.array(middle_of(held)) - wrist)
        self._held_axes = turn
        self._held_half = np.array(size_of(held)) / 2

    def can_reach(self, poses: Poses) -> NDArray[np.bool_]:
        """Return whether the arm reaches the wrist of each pose (n,)."""
        near: NDArray[np.bool_] = np.linalg.norm(poses.wrists - self.shoulder, axis=1) <= self.reach
        return near

    @property
    def reach(self) -> float:
        """Maximum distance of the wrist from the shoulder, metres."""
        return sum(self._lengths) * _STRETCHED

    def held_box(self, poses: Poses) -> Parts:
        """Return the box of the held object (n, 1)."""
        center = poses.world() + poses.turns @ self.lever
        axes = self._held_axes @ poses.turns.transpose(0, 2, 1)
        return Parts(
            center[:, None], axes[:, None], np.broadcast_to(self._held_half, (len(poses), 1, 3))
        )

    def parts(self, poses: Poses) -> Parts:
        """Return all boxes (n, 5): base, upper arm, forearm, palm, and the held object."""
        elbows = self._elbows(poses.wrists)
        foot = np.broadcast_to(self._foot, elbows.shape)
        shoulder = np.broadcast_to(self.shoulder, elbows.shape)
        rods = [_rod(foot, shoulder), _rod(shoulder, elbows), _rod(elbows, poses.wrists)]
        palm_axes = poses.turns.transpose(0, 2, 1)[:, None]
        palm = Parts(poses.wrists[:, None], palm_axes, np.full((len(poses), 1, 3), _THICK))
        lifted = [
            Parts(p.center + (poses.bases[:, None] * _UP)[:, None], p.axes, p.half)
            for p in (*rods, palm)
        ]
        return Parts.join([*lifted, self.held_box(poses)])

    def _elbows(self, wrists: Array) -> Array:
        """Return elbows (n, 3) of wrists (n, 3): where both links meet, on the measured side."""
        line = wrists - self.shoulder
        far = np.clip(np.linalg.norm(line, axis=1), _TINY, sum(self._lengths))
        upper, fore = self._lengths
        along = np.clip((far**2 + upper**2 - fore**2) / (2 * far), -upper, upper)
        over, aside = _normals(line)
        out = self._side[0] * over + self._side[1] * aside
        elbows: Array = (
            self.shoulder
            + (along / far)[:, None] * line
            + np.sqrt(upper**2 - along**2)[:, None] * out
        )
        return elbows


def _normals(lines: Array) -> tuple[Array, Array]:
    """Return unit vectors (n, 3) at right angles to some lines (n, 3): upwards and to the side."""
    x, y, z = (lines / np.maximum(np.linalg.norm(lines, axis=1, keepdims=True), _TINY)).T
    level = np.maximum(np.hypot(x, z), _TINY)
    x /= level
    z /= level
    nothing = np.zeros_like(x)
    return np.stack([-x * y, level, -z * y], axis=1), np.stack([z, nothing, -x], axis=1)


def _elbow_side(upper: Array, line: Array) -> tuple[float, float]:
    """Return an elbow's direction from the line of shoulder and wrist: shares upwards, aside."""
    over, aside = _normals(line[None])
    out = float(over[0] @ upper), float(aside[0] @ upper)
    length = math.hypot(*out)
    return (1.0, 0.0) if length < _TINY else (out[0] / length, out[1] / length)


def _rod(start: Array, end: Array) -> Parts:
    """Return boxes (n, 1) along links."""
    line = end - start
    length = np.linalg.norm(line, axis=1)
    over, aside = _normals(line)
    axes = np.stack([aside, over, line / np.maximum(length, _TINY)[:, None]], axis=1)
    half = np.stack([np.full(len(line), _THICK), np.full(len(line), _THICK), length / 2], axis=1)
    return Parts(((start + end) / 2)[:, None], axes[:, None], half[:, None])


def _matrix(rotation: AxisAngle) -> Array:
    axis = np.array([rotation.x, rotation.y, rotation.z])
    return rotations_about(axis, np.array([math.radians(rotation.w)]))[0]


def rotations_about(axis: Array, angles: Array) -> Array:
    """Return rotations (n, 3, 3) about a unit axis by angles (n,), radians: Rodrigues' formula."""
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    rotations: Array = (
        np.eye(3)
        + np.sin(angles)[:, None, None] * skew
        + (1.0 - np.cos(angles))[:, None, None] * (skew @ skew)
    )
    return rotations


def heading(yaws: Array, pitches: Array) -> Array:
    """Return rotations (n, 3, 3) of hands to a yaw (n,) and down by a pitch (n,), radians."""
    return rotations_about(_UP, yaws) @ rotations_about(np.array([1.0, 0.0, 0.0]), pitches)


def angles_of(turn: Array) -> tuple[float, float, float]:
    """Return a rotation's (3, 3) pitch, yaw and roll, degrees, as `RotateWristRelative` takes."""
    pitch = math.asin(float(np.clip(-turn[1, 2], -1.0, 1.0)))
    yaw = math.atan2(turn[0, 2], turn[2, 2])
    roll = math.atan2(turn[1, 0], turn[1, 1])
    return math.degrees(pitch), math.degrees(yaw), -math.degrees(roll)
