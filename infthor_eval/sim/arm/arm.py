"""The state of an arm: how it is bent, how large the sphere of its hand is, and what it holds."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from infthor_eval.sim.agent import Agent, Grip
from infthor_eval.sim.arm.rig import ArmPose, Rig
from infthor_eval.sim.geometry import Array

__all__ = ["Arm", "Frame", "base_frames"]

_RADIUS = 0.06  # metres, of the hand's sphere when the agent is made


class Frame(NamedTuple):
    """A place (3,) in metres and a rotation (3, 3)."""

    origin: Array
    turn: Array

    def point(self, local: Array) -> Array:
        """A point (3,) of this frame, in the world."""
        return self.origin + self.turn @ local

    def local(self, point: Array) -> Array:
        """A point (3,) of the world, in this frame."""
        inside: Array = self.turn.T @ (point - self.origin)
        return inside


def base_frames(rig: Rig, positions: Array, yaws: Array, poses: Sequence[ArmPose]) -> tuple[Array, Array]:
    """Origins (n, 3) and rotations (n, 3, 3) of the arm's base in the world.

    Args:
        rig: the arm's.
        positions: where the agent is, metres (n, 3).
        yaws: which way it looks, degrees (n,).
        poses: how the arm is bent.
    """
    offsets = np.stack([rig.origin(pose) for pose in poses])[:, :, None]
    return positions + (_upright(yaws) @ offsets)[:, :, 0], _upright(yaws + rig.heading)


def _upright(yaws: Array) -> Array:
    """Rotations (n, 3, 3) about the vertical."""
    sines, cosines = np.sin(np.radians(yaws)), np.cos(np.radians(yaws))
    turns = np.zeros((len(yaws), 3, 3))
    turns[:, 0, 0] = turns[:, 2, 2] = cosines
    turns[:, 0, 2], turns[:, 2, 0], turns[:, 1, 1] = sines, -sines, 1.0
    return turns


@dataclass
class Arm:
    """An arm.

    Attributes:
        radius: of the hand's sphere, metres.
        held: how each thing that the hand holds is held, in the wrist's frame, by id, in the order of picking up.
        freight: likewise the contents of what is held.
        version: grows with every change, so that pictures can be kept.
    """

    rig: Rig
    pose: ArmPose
    radius: float = _RADIUS
    held: dict[str, Grip] = field(default_factory=dict)
    freight: dict[str, Grip] = field(default_factory=dict)
    version: int = 0

    @classmethod
    def at_rest(cls, rig: Rig) -> "Arm":
        """An arm as it is when the agent is made."""
        return cls(rig, rig.rest())

    def base(self, agent: Agent) -> Frame:
        """The frame of the base in the world."""
        origins, turns = base_frames(self.rig, agent.position[None], np.array([agent.yaw]), [self.pose])
        return Frame(origins[0], turns[0])

    def wrist(self, agent: Agent) -> Frame:
        """The frame of the wrist in the world."""
        base = self.base(agent)
        return Frame(base.point(self.pose.wrist), base.turn @ self.pose.turn)

    def sphere(self, agent: Agent) -> Array:
        """Centre (3,) of the hand's sphere in the world, metres."""
        return self.wrist(agent).point(self.rig.palm + np.array([0.0, 0.0, self.radius]))

    def change(self, pose: ArmPose) -> None:
        """Bend the arm; what it holds is to be carried along."""
        self.pose = pose
        self.version += 1

    def grips(self) -> Iterator[tuple[str, Grip]]:
        """How all that moves with the hand is held, by id."""
        yield from self.held.items()
        yield from self.freight.items()

    def let_go(self, object_id: str) -> None:
        """Forget one thing, whether it was held, in what is held, or neither."""
        self.held.pop(object_id, None)
        self.freight.pop(object_id, None)
