"""Stretch's arm: a lift, a telescope to the agent's right, a wrist that turns about the vertical.

The positions of the joints are from published metadata of a Unity build, the limits from Unity's
solver. Thicknesses are ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from infthor_sim.arm.boxes import Boxes
from infthor_sim.arm.rig import ArmPose, Joints
from infthor_sim.geometry import Array, yaw_matrix

# All lengths in metres.
_ORIGIN = (0.1438, -0.8132, -0.0239)  # of the base, in the agent's frame
# limits of the wrist's height above the base; longest extension
_LIFTS = (-0.056, 1.045)
_OUT = 0.516
_REST = (0.0, 0.1645, 0.0)
# the lift's joint relative to the wrist's height, in the frame of the base
_MAST = (0.0461, 0.163, -0.2788)
_TUBE = (0.083, 0.163, -0.0241)  # the first section of the telescope, likewise
# each section from the one before, telescope drawn in
_SECTIONS = (0.0, 0.0130003, 0.0130005, 0.0130003, 0.0117463)
# heights of the wrist's two joints above the hand
_YAW_JOINT = 0.1494
_HAND_JOINT = 0.0987
_PALM = 0.2047 - 0.06  # the sphere's centre in the recorded pose, less its radius there
_HALVES: Array = np.array([(0.03, 0.03, 0.0), (0.025, 0.05, 0.025), (0.03, 0.02, _PALM / 2)])
_LEVEL: Array = np.eye(3)


@dataclass(frozen=True)
class Stretch:
    """The rig of agent mode `stretch`."""

    joint_names: tuple[str, ...] = (
        "stretch_robot_lift_jnt",
        *(f"stretch_robot_arm_{number}_jnt" for number in range(1, 6)),
        "stretch_robot_wrist_1_jnt",
        "stretch_robot_wrist_2_jnt",
    )
    has_elbow: bool = False
    heading: float = 90.0
    lifts: tuple[float, float] = (_ORIGIN[1] + _LIFTS[0], _ORIGIN[1] + _LIFTS[1])

    @property
    def palm(self) -> Array:
        """Point of the wrist's frame at which the hand's sphere begins, metres (3,)."""
        return np.array([0.0, 0.0, _PALM])

    def rest(self) -> ArmPose:
        """Return the resting pose: telescope in, gripper pointing back across the robot."""
        return ArmPose(np.array(_REST), yaw_matrix(180.0))

    def origin(self, pose: ArmPose) -> Array:
        """Return the position of the base in the agent's frame, metres (3,)."""
        return np.array(_ORIGIN)

    def with_lift(self, pose: ArmPose, height: float) -> ArmPose:
        """Return the pose with its wrist at a height above the agent's position, metres."""
        return self.reach([pose], np.array([[0.0, height - _ORIGIN[1], pose.wrist[2]]]))[0]

    def lift(self, pose: ArmPose) -> float:
        """Return the height of the wrist above the agent's position, metres."""
        return float(_ORIGIN[1] + pose.wrist[1])

    def reach(self, poses: Sequence[ArmPose], targets: Array) -> list[ArmPose]:
        """Return poses (n) with the wrist as near to targets (n, 3) as lift and telescope allow."""
        wrists = np.zeros_like(targets)
        wrists[:, 1], wrists[:, 2] = (
            np.clip(targets[:, 1], *_LIFTS),
            np.clip(targets[:, 2], 0.0, _OUT),
        )
        return [replace(pose, wrist=wrist) for pose, wrist in zip(poses, wrists, strict=True)]

    def joints(self, poses: Sequence[ArmPose]) -> Joints:
        """Return the joints: the lift, five sections of the telescope, the wrist's two."""
        wrists = np.stack([p.wrist for p in poses])
        positions = np.zeros((len(poses), 8, 3))
        positions[:, 0] = _MAST
        positions[:, 1:6] = _TUBE
        positions[:, 1:6, 2] += np.cumsum(_SECTIONS) + np.arange(5) * wrists[:, 2:] / 4
        positions[:, :, 1] += wrists[:, 1:2]
        positions[:, 6:] = wrists[:, None] + np.array(
            [[0.0, _YAW_JOINT, 0.0], [0.0, _HAND_JOINT, 0.0]]
        )
        turns = np.broadcast_to(_LEVEL, (len(poses), 8, 3, 3)).copy()
        turns[:, 6:] = np.stack([p.turn for p in poses])[:, None]
        return Joints(positions, turns)

    def boxes(self, poses: Sequence[ArmPose]) -> Boxes:
        """Return telescope, wrist and gripper of poses (n, 3), in the frame of the base."""
        joints = self.joints(poses)
        mast = joints.positions[:, 0]
        out = joints.positions[:, 5]
        wrist = joints.positions[:, 7]
        turns = joints.turns
        tube = (np.stack([out[:, 0], out[:, 1], mast[:, 2]], axis=1) + out) / 2
        palm = (
            wrist
            - np.array([0.0, _HAND_JOINT, 0.0])
            + turns[:, 7] @ np.array([0.0, 0.0, _PALM / 2])
        )
        halves = np.tile(_HALVES, (len(poses), 1, 1))
        halves[:, 0, 2] = (out[:, 2] - mast[:, 2]) / 2
        return Boxes(
            np.stack([tube, wrist - np.array([0.0, _HAND_JOINT / 2, 0.0]), palm], axis=1),
            np.stack([turns[:, 0], turns[:, 6], turns[:, 7]], axis=1).transpose(0, 1, 3, 2),
            halves,
        )

    def allows(self, target: Array) -> bool:
        """Return True: Unity restricts no target of this arm."""
        return True
