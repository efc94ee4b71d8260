"""The interface of an arm: a pose, and a rig that computes joints and boxes from it.

To add a robot arm: a rig in this package, and its line in `infthor_sim/simulation.py`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from infthor_sim.arm.boxes import Boxes
from infthor_sim.geometry import Array


@dataclass(frozen=True)
class ArmPose:
    """The pose of an arm in the frame of its base, which turns with the agent.

    Attributes:
        wrist: position of the wrist, metres (3,).
        turn: rotation of the wrist (3, 3).
        base: height of the base above the agent's position, metres; unused by arms with a fixed
            base.
        elbow: angle of the elbow about the line from shoulder to wrist, degrees.
    """

    wrist: Array
    turn: Array
    base: float = 0.0
    elbow: float = 0.0


@dataclass(frozen=True)
class Joints:
    """The joints of an arm in some poses (n), in the frame of its base.

    Attributes:
        positions: positions from the base to the wrist, metres (n, joints, 3).
        turns: rotations (n, joints, 3, 3); a joint's z points along the link that begins at it.
    """

    positions: Array
    turns: Array


class Rig(Protocol):
    """The geometry of one kind of arm; it has no state."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, as the metadata has them."""

    @property
    def heading(self) -> float:
        """Yaw of the base relative to the agent, degrees."""

    @property
    def has_elbow(self) -> bool:
        """Whether the arm has an elbow that can be turned, and a base that moves up and down."""

    @property
    def palm(self) -> Array:
        """Point of the wrist's frame where the hand's sphere begins, along z, metres (3,)."""

    @property
    def lifts(self) -> tuple[float, float]:
        """Lowest and highest height of the base or lift above the agent's position, metres."""

    def rest(self) -> ArmPose:
        """Return the resting pose."""

    def origin(self, pose: ArmPose) -> Array:
        """Return the position of the base in the agent's frame (right, up, ahead), metres (3,)."""

    def with_lift(self, pose: ArmPose, height: float) -> ArmPose:
        """Return the pose with base or lift at a height above the agent's position, metres."""

    def lift(self, pose: ArmPose) -> float:
        """Return the height above the agent's position of the base, or of the lift, metres."""

    def reach(self, poses: Sequence[ArmPose], targets: Array) -> list[ArmPose]:
        """Return poses (n) with the wrist nearest to targets (n, 3) in the frame of the base."""

    def joints(self, poses: Sequence[ArmPose]) -> Joints:
        """Return the joints of some poses (n)."""

    def boxes(self, poses: Sequence[ArmPose]) -> Boxes:
        """Return links and hand of poses (n, m), the hand last, in the frame of the base."""

    def allows(self, target: Array) -> bool:
        """Return whether `restrictMovement` allows a wrist target (3,) in the base's frame."""
