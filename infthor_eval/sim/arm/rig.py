"""What an arm is to the rest of the simulator: a pose, and a rig that turns it into joints and boxes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from infthor_eval.sim.arm.boxes import Boxes
from infthor_eval.sim.geometry import Array

__all__ = ["ArmPose", "Joints", "Rig"]


@dataclass(frozen=True)
class ArmPose:
    """How an arm is bent, in the frame of its base, which turns with the agent.

    Attributes:
        wrist: where the wrist is, metres (3,).
        turn: rotation of the wrist (3, 3).
        base: height of the base above the agent's position, metres; arms whose base is fixed leave it.
        elbow: degrees that the elbow is turned about the line from shoulder to wrist.
    """

    wrist: Array
    turn: Array
    base: float = 0.0
    elbow: float = 0.0


@dataclass(frozen=True)
class Joints:
    """The joints of an arm in some poses (n), in the frame of its base.

    Attributes:
        positions: metres (n, joints, 3), from the base to the wrist.
        turns: rotations (n, joints, 3, 3); a joint looks along the link that begins at it.
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
        """Degrees by which the base is turned from the agent's forward direction."""

    @property
    def has_elbow(self) -> bool:
        """Whether it has an elbow that can be turned, and a base that moves up and down."""

    @property
    def palm(self) -> Array:
        """Where the sphere of the hand begins, in the wrist's frame, metres (3,); it lies along the wrist's z."""

    @property
    def lifts(self) -> tuple[float, float]:
        """Lowest and highest height of the base, or of the lift, above the agent's position, metres."""

    def rest(self) -> ArmPose:
        """How the arm is held when the agent is made."""

    def origin(self, pose: ArmPose) -> Array:
        """Where the base is in the agent's frame (right, up, ahead), metres (3,)."""

    def lifted(self, pose: ArmPose, height: float) -> ArmPose:
        """The pose with its base, or its lift, at a height above the agent's position, metres."""

    def lift(self, pose: ArmPose) -> float:
        """Height above the agent's position of the base, or of the lift, metres."""

    def reaching(self, poses: Sequence[ArmPose], targets: Array) -> list[ArmPose]:
        """Poses (n) with the wrist at targets (n, 3) in the frame of the base, or as near as it gets."""

    def joints(self, poses: Sequence[ArmPose]) -> Joints:
        """Where the joints of some poses (n) are."""

    def boxes(self, poses: Sequence[ArmPose]) -> Boxes:
        """The links and the hand of some poses (n, m), the hand last, in the frame of the base."""

    def allows(self, target: Array) -> bool:
        """Whether `restrictMovement` lets the wrist be sent to a target (3,) in the frame of the base."""
