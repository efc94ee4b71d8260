"""ManipulaTHOR's arm: a base that moves up and down, three equal links, a wrist that turns freely.

From Unity: the reach (0.6335 m from the shoulder, 0.6325 m where restricted), the heights of the
base, the resting pose and the order of joints. The length of a link follows: Unity's solver uses
the links interchangeably, and two of them make the reach. Ours: the thickness of the links, and
that the elbow points up and to the right while `elbow` is 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from infthor_sim.arm.boxes import Boxes
from infthor_sim.arm.rig import ArmPose, Joints
from infthor_sim.geometry import Array, cross

LINK = 0.31675  # metres from joint to joint
SHOULDER: Array = np.array([0.0, 0.0, LINK])
_ALLOWED = 0.6325  # metres from the shoulder that restricted movements may go
_REST = (0.0, 0.0, 0.4)
_REST_BASE = -0.003
# of Unity's agent capsule: a quarter of its height below its middle, and its top; metres
_LIFTS = (-0.45, 0.9)
_THICK = (0.04, 0.035, 0.03)  # half thickness of the links from the base to the wrist, metres
PALM = ((0.0, 0.0, -0.015), (0.04, 0.028, 0.025))  # middle and half extents in the wrist's frame
# metres that the fingers reach ahead of the wrist; they do not collide, as they close around things
FINGERS = 0.05
_UP: Array = np.array([0.0, 1.0, 0.0])
_RIGHT: Array = np.array([1.0, 0.0, 0.0])
_AHEAD: Array = np.array([0.0, 0.0, 1.0])
_LEVEL: Array = np.eye(3)
# degrees of the elbow from up to the right: a forearm above the hand would hide it from the camera
_LEAN = 50.0
_AT_SHOULDER = 1e-9  # metres from the shoulder below which the direction to the wrist is undefined
# sine of the angle from the vertical below which the line to the wrist counts as vertical
_UPRIGHT = 1e-6


def inverse(targets: Array, elbows: Array) -> Array:
    """Return rotations (n, 2, 3, 3) of shoulder and elbow that bring the wrist nearest to targets.

    Args:
        targets: targets in the frame of the base, metres (n, 3).
        elbows: angles of the elbow about the line from shoulder to wrist, degrees (n,); 0: up and
            to the right.
    """
    # Shoulder, elbow and wrist make an isosceles triangle with two sides of LINK. Its base lies on
    # the line to the target (`ahead`); the elbow is above its middle in the direction `out`, which
    # the elbow's angle turns about it.
    lines = targets - SHOULDER
    distances = np.linalg.norm(lines, axis=1, keepdims=True)
    ahead = np.where(distances > _AT_SHOULDER, lines / np.maximum(distances, _AT_SHOULDER), _AHEAD)
    aside = cross(np.broadcast_to(_UP, ahead.shape), ahead)
    upright = np.linalg.norm(aside, axis=1, keepdims=True) < _UPRIGHT
    # A vertical line has no level right-hand side: the base's is taken, made perpendicular to the
    # line.
    aside = np.where(upright, _RIGHT - ahead * ahead[:, :1], aside)
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    angles = np.radians(elbows - _LEAN)[:, None]
    out = np.cos(angles) * cross(ahead, aside) - np.sin(angles) * aside
    # beyond its reach the arm is stretched out towards the target
    along = np.minimum(distances / 2, LINK)
    upper = (along * ahead + np.sqrt(np.maximum(LINK**2 - along**2, 0.0)) * out) / LINK
    fore = 2 * along * ahead / LINK - upper
    normal = cross(out, ahead)
    return np.stack([_look_rotations(upper, normal), _look_rotations(fore, normal)], axis=1)


def forward(turns: Array) -> Array:
    """Return positions (n, 4, 3) of base, shoulder, elbow and wrist by (n, 2, 3, 3) rotations."""
    elbows = SHOULDER + LINK * turns[:, 0, :, 2]
    shoulders = np.broadcast_to(SHOULDER, elbows.shape)
    return np.stack(
        [np.zeros_like(elbows), shoulders, elbows, elbows + LINK * turns[:, 1, :, 2]], axis=1
    )


def _look_rotations(ahead: Array, aside: Array) -> Array:
    """Return rotations (n, 3, 3) with z `ahead` and x `aside`, perpendicular unit vectors."""
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
        """Point of the wrist's frame at which the hand's sphere begins, metres (3,)."""
        return np.array([0.0, 0.0, 0.01])

    def rest(self) -> ArmPose:
        """Return the resting pose."""
        return ArmPose(np.array(_REST), _LEVEL, base=_REST_BASE)

    def origin(self, pose: ArmPose) -> Array:
        """Return the position of the base in the agent's frame, metres (3,)."""
        return np.array([0.0, pose.base, 0.0])

    def with_lift(self, pose: ArmPose, height: float) -> ArmPose:
        """Return the pose with its base at a height above the agent's position, metres."""
        return replace(pose, base=height)

    def lift(self, pose: ArmPose) -> float:
        """Return the height of the base above the agent's position, metres."""
        return pose.base

    def reach(self, poses: Sequence[ArmPose], targets: Array) -> list[ArmPose]:
        """Return poses (n) with the wrist nearest to targets (n, 3) in the frame of the base."""
        wrists = forward(inverse(targets, np.array([p.elbow for p in poses])))[:, 3]
        return [replace(pose, wrist=wrist) for pose, wrist in zip(poses, wrists, strict=True)]

    def joints(self, poses: Sequence[ArmPose]) -> Joints:
        """Return the joints; the first looks ahead, the last as the wrist does."""
        turns = inverse(np.stack([p.wrist for p in poses]), np.array([p.elbow for p in poses]))
        bases = np.broadcast_to(_LEVEL, (len(poses), 1, 3, 3))
        wrists = np.stack([p.turn for p in poses])[:, None]
        return Joints(forward(turns), np.concatenate([bases, turns, wrists], axis=1))

    def boxes(self, poses: Sequence[ArmPose]) -> Boxes:
        """Return three links and the palm of each pose (n, 4), in the frame of the base."""
        joints = self.joints(poses)
        links = (joints.positions[:, :3] + joints.positions[:, 1:]) / 2
        palms = joints.positions[:, 3:] + joints.turns[:, 3:] @ np.array(PALM[0])
        halves = np.array([*((thick, thick, LINK / 2) for thick in _THICK), PALM[1]])
        centers = np.concatenate([links, palms], axis=1)
        return Boxes(
            centers, joints.turns.transpose(0, 1, 3, 2), np.broadcast_to(halves, centers.shape)
        )

    def allows(self, target: Array) -> bool:
        """Return whether a target is in front of the shoulder and within reach."""
        line = target - SHOULDER
        return bool(line[2] >= 0.0 and np.linalg.norm(line) <= _ALLOWED)
