"""ManipulaTHOR's arm: a base that moves up and down, three links of equal length, and a wrist that turns freely.

The reach (0.6335 m from the shoulder, 0.6325 m where restricted), the heights of the base, the resting pose and the
order of joints are Unity's. The length of a link follows: Unity's solver exchanges them freely and two make the reach.
Thicknesses, and that the elbow points up and to the right while `elbow` is 0, are ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from infthor_eval.sim.arm.boxes import Boxes
from infthor_eval.sim.arm.rig import ArmPose, Joints
from infthor_eval.sim.geometry import Array, cross

__all__ = ["FINGERS", "LINK", "PALM", "SHOULDER", "Kinova", "forward", "inverse"]

LINK = 0.31675  # metres from joint to joint
SHOULDER: Array = np.array([0.0, 0.0, LINK])
_ALLOWED = 0.6325  # metres from the shoulder that restricted movements may go
_REST = (0.0, 0.0, 0.4)
_REST_BASE = -0.003
_LIFTS = (-0.45, 0.9)  # of the agent's capsule: a quarter of its height below its middle, and its top
_THICK = (0.04, 0.035, 0.03)  # half thickness of the links, from the base on
PALM = ((0.0, 0.0, -0.015), (0.04, 0.028, 0.025))  # middle and half extents in the wrist's frame
FINGERS = 0.05  # metres that the fingers reach ahead of the wrist; they do not collide, as they close around things
_UP: Array = np.array([0.0, 1.0, 0.0])
_RIGHT: Array = np.array([1.0, 0.0, 0.0])
_AHEAD: Array = np.array([0.0, 0.0, 1.0])
_LEVEL: Array = np.eye(3)
_LEAN = 50.0  # degrees of the elbow from up to the right: the forearm must not hide the hand from the camera
_NOWHERE = 1e-9  # metres from the shoulder at which the wrist is in no direction
_UPRIGHT = 1e-6  # sine of an angle from the vertical at which the elbow's side is the base's


def inverse(targets: Array, elbows: Array) -> Array:
    """Rotations (n, 2, 3, 3) of shoulder and elbow that bring the wrist to targets (n, 3), or as near as it gets.

    Args:
        targets: metres, in the frame of the base.
        elbows: degrees (n,) that the elbow is turned about the line from shoulder to wrist; 0: up and to the right.
    """
    lines = targets - SHOULDER
    distances = np.linalg.norm(lines, axis=1, keepdims=True)
    ahead = np.where(distances > _NOWHERE, lines / np.maximum(distances, _NOWHERE), _AHEAD)
    aside = cross(np.broadcast_to(_UP, ahead.shape), ahead)
    upright = np.linalg.norm(aside, axis=1, keepdims=True) < _UPRIGHT
    aside = np.where(upright, _RIGHT - ahead * ahead[:, :1], aside)
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    angles = np.radians(elbows - _LEAN)[:, None]
    out = np.cos(angles) * cross(ahead, aside) - np.sin(angles) * aside
    along = np.minimum(distances / 2, LINK)
    upper = (along * ahead + np.sqrt(np.maximum(LINK**2 - along**2, 0.0)) * out) / LINK
    fore = 2 * along * ahead / LINK - upper
    normal = cross(out, ahead)
    return np.stack([_looking(upper, normal), _looking(fore, normal)], axis=1)


def forward(turns: Array) -> Array:
    """Positions (n, 4, 3) in metres of base, shoulder, elbow and wrist by rotations (n, 2, 3, 3) of the middle two."""
    elbows = SHOULDER + LINK * turns[:, 0, :, 2]
    shoulders = np.broadcast_to(SHOULDER, elbows.shape)
    return np.stack([np.zeros_like(elbows), shoulders, elbows, elbows + LINK * turns[:, 1, :, 2]], axis=1)


def _looking(ahead: Array, aside: Array) -> Array:
    """Rotations (n, 3, 3) whose z is `ahead`, unit vectors, and whose x is `aside`, others at a right angle to them."""
    return np.stack([aside, cross(ahead, aside), ahead], axis=2)


@dataclass(frozen=True)
class Kinova:
    """The rig of agent mode `arm`."""

    joint_names: tuple[str, ...] = tuple(f"robot_arm_{number}_jnt" for number in range(1, 5))
    has_elbow: bool = True
    heading: float = 0.0
    lifts: tuple[float, float] = _LIFTS

    @property
    def palm(self) -> Array:
        """Where the sphere of the hand begins, in the wrist's frame, metres (3,)."""
        return np.array([0.0, 0.0, 0.01])

    def rest(self) -> ArmPose:
        """How the arm is held when the agent is made."""
        return ArmPose(np.array(_REST), _LEVEL, base=_REST_BASE)

    def origin(self, pose: ArmPose) -> Array:
        """Where the base is in the agent's frame, metres (3,)."""
        return np.array([0.0, pose.base, 0.0])

    def lifted(self, pose: ArmPose, height: float) -> ArmPose:
        """The pose with its base at a height above the agent's position, metres."""
        return replace(pose, base=height)

    def lift(self, pose: ArmPose) -> float:
        """Height of the base above the agent's position, metres."""
        return pose.base

    def reaching(self, poses: Sequence[ArmPose], targets: Array) -> list[ArmPose]:
        """Poses (n) with the wrist at targets (n, 3) in the frame of the base, or as near as it gets."""
        wrists = forward(inverse(targets, np.array([p.elbow for p in poses])))[:, 3]
        return [replace(pose, wrist=wrist) for pose, wrist in zip(poses, wrists, strict=True)]

    def joints(self, poses: Sequence[ArmPose]) -> Joints:
        """Where the joints are; the first looks ahead, the last as the wrist does."""
        turns = inverse(np.stack([p.wrist for p in poses]), np.array([p.elbow for p in poses]))
        bases = np.broadcast_to(_LEVEL, (len(poses), 1, 3, 3))
        wrists = np.stack([p.turn for p in poses])[:, None]
        return Joints(forward(turns), np.concatenate([bases, turns, wrists], axis=1))

    def boxes(self, poses: Sequence[ArmPose]) -> Boxes:
        """Three links and the palm of each pose (n, 4), in the frame of the base."""
        joints = self.joints(poses)
        links = (joints.positions[:, :3] + joints.positions[:, 1:]) / 2
        palms = joints.positions[:, 3:] + joints.turns[:, 3:] @ np.array(PALM[0])
        halves = np.array([*((thick, thick, LINK / 2) for thick in _THICK), PALM[1]])
        centers = np.concatenate([links, palms], axis=1)
        return Boxes(centers, joints.turns.transpose(0, 1, 3, 2), np.broadcast_to(halves, centers.shape))

    def allows(self, target: Array) -> bool:
        """Whether a target is in front of the shoulder and within reach."""
        line = target - SHOULDER
        return bool(line[2] >= 0.0 and np.linalg.norm(line) <= _ALLOWED)
