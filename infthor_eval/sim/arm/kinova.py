"""ManipulaTHOR's arm: a base that moves up and down, three links of equal length, and a wrist that turns freely.

The reach (0.6335 m from the shoulder, 0.6325 m where restricted), the heights of the base, the resting pose and the
order of joints are Unity's. The length of a link follows: Unity's solver exchanges them freely and two make the reach.
Thicknesses, and that the elbow points up while `elbow` is 0, are ours.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from infthor_eval.sim.arm.boxes import Boxes
from infthor_eval.sim.arm.rig import ArmPose, Joints
from infthor_eval.sim.geometry import Array

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


def inverse(target: Array, elbow: float) -> Array:
    """Rotations (2, 3, 3) of shoulder and elbow that bring the wrist to a target (3,), or as near as it gets.

    Args:
        target: metres, in the frame of the base.
        elbow: degrees that the elbow is turned about the line from shoulder to wrist; 0: up.
    """
    line = target - SHOULDER
    distance = float(np.linalg.norm(line))
    ahead = line / distance if distance > 1e-9 else _AHEAD
    aside = np.cross(_UP, ahead)
    if np.linalg.norm(aside) < 1e-6:
        aside = _RIGHT - ahead * float(_RIGHT @ ahead)
    aside /= np.linalg.norm(aside)
    angle = math.radians(elbow)
    out = math.cos(angle) * np.cross(ahead, aside) - math.sin(angle) * aside
    along = min(distance / 2, LINK)
    upper = (along * ahead + math.sqrt(max(LINK**2 - along**2, 0.0)) * out) / LINK
    fore = (2 * along * ahead - LINK * upper) / LINK
    normal = np.cross(out, ahead)
    return np.stack([_looking(upper, normal), _looking(fore, normal)])


def forward(turns: Array) -> Array:
    """Positions (4, 3) in metres of base, shoulder, elbow and wrist by the rotations (2, 3, 3) of the middle two."""
    elbow = SHOULDER + LINK * turns[0, :, 2]
    return np.stack([np.zeros(3), SHOULDER, elbow, elbow + LINK * turns[1, :, 2]])


def _looking(ahead: Array, aside: Array) -> Array:
    """The rotation (3, 3) whose z is `ahead`, a unit vector, and whose x is `aside`, one at a right angle to it."""
    return np.stack([aside, np.cross(ahead, aside), ahead], axis=1)


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

    def reaching(self, pose: ArmPose, target: Array) -> ArmPose:
        """The pose with the wrist at a target (3,) in the frame of the base, or as near as it gets."""
        return replace(pose, wrist=forward(inverse(target, pose.elbow))[3])

    def joints(self, pose: ArmPose) -> Joints:
        """Where the joints are; the first looks ahead, the last as the wrist does."""
        turns = inverse(pose.wrist, pose.elbow)
        return Joints(forward(turns), np.stack([_LEVEL, *turns, pose.turn]))

    def boxes(self, pose: ArmPose) -> Boxes:
        """Three links and the palm, in the frame of the base."""
        joints = self.joints(pose)
        centers = (joints.positions[:3] + joints.positions[1:]) / 2
        halves = [(thick, thick, LINK / 2) for thick in _THICK]
        palm = pose.wrist + pose.turn @ np.array(PALM[0])
        return Boxes(
            np.concatenate([centers, palm[None]]), joints.turns.transpose(0, 2, 1), np.array([*halves, PALM[1]])
        )

    def allows(self, target: Array) -> bool:
        """Whether a target is in front of the shoulder and within reach."""
        line = target - SHOULDER
        return bool(line[2] >= 0.0 and np.linalg.norm(line) <= _ALLOWED)
