"""The state of an arm: its pose, the sphere of its hand, and what it holds."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from infthor_sim.agent import Agent, Grip
from infthor_sim.arm.rig import ArmPose, Rig
from infthor_sim.geometry import Array

_RADIUS = 0.06  # of the hand's sphere after Initialize, metres


class Transform(NamedTuple):
    """A local frame in the world.

    Attributes:
        origin: position of its origin, metres (3,).
        turn: its rotation (3, 3).
    """

    origin: Array
    turn: Array

    def point(self, local: Array) -> Array:
        """Return a point (3,) of this frame in the world."""
        return self.origin + self.turn @ local

    def local(self, point: Array) -> Array:
        """Return a point (3,) of the world in this frame."""
        inside: Array = self.turn.T @ (point - self.origin)
        return inside


def base_transforms(
    rig: Rig, positions: Array, yaws: Array, poses: Sequence[ArmPose]
) -> tuple[Array, Array]:
    """Return origins (n, 3) and rotations (n, 3, 3) of the arm's base in the world.

    Args:
        rig: its geometry.
        positions: positions of the agent, metres (n, 3).
        yaws: directions of the agent, degrees (n,).
        poses: poses of the arm (n).
    """
    # All stances of a path at once: a path has up to thousands, and numpy's calls would take longer
    # than the sums.
    offsets = np.stack([rig.origin(pose) for pose in poses])[:, :, None]
    return positions + (_upright(yaws) @ offsets)[:, :, 0], _upright(yaws + rig.heading)


def _upright(yaws: Array) -> Array:
    """Return rotations (n, 3, 3) about the vertical."""
    sines = np.sin(np.radians(yaws))
    cosines = np.cos(np.radians(yaws))
    turns = np.zeros((len(yaws), 3, 3))
    turns[:, 0, 0] = turns[:, 2, 2] = cosines
    turns[:, 0, 2] = sines
    turns[:, 2, 0] = -sines
    turns[:, 1, 1] = 1.0
    return turns


@dataclass
class Arm:
    """An arm.

    Attributes:
        rig: geometry.
        pose: present pose.
        radius: radius of the hand's sphere, metres.
        held: poses of the held objects in the wrist's frame, by id, in the order of picking up.
        held_contents: poses of the contents of held objects, likewise.
        version: number that grows with every change; cached pictures compare it.
    """

    rig: Rig
    pose: ArmPose
    radius: float = _RADIUS
    held: dict[str, Grip] = field(default_factory=dict)
    held_contents: dict[str, Grip] = field(default_factory=dict)
    version: int = 0

    def base(self, agent: Agent) -> Transform:
        """Return the frame of the base in the world."""
        origins, turns = base_transforms(
            self.rig, agent.position[None], np.array([agent.yaw]), [self.pose]
        )
        return Transform(origins[0], turns[0])

    def wrist(self, agent: Agent) -> Transform:
        """Return the frame of the wrist in the world."""
        base = self.base(agent)
        return Transform(base.point(self.pose.wrist), base.turn @ self.pose.turn)

    def sphere(self, agent: Agent) -> Array:
        """Return the centre (3,) of the hand's sphere in the world, metres."""
        return self.wrist(agent).point(self.rig.palm + np.array([0.0, 0.0, self.radius]))

    def change(self, pose: ArmPose) -> None:
        """Give the arm another pose; the caller moves what it holds."""
        self.pose = pose
        self.version += 1

    def grips(self) -> Iterator[tuple[str, Grip]]:
        """Yield ids and poses in the wrist's frame of held objects, then of their contents."""
        yield from self.held.items()
        yield from self.held_contents.items()

    def let_go(self, object_id: str) -> None:
        """Forget one object, whether it was held, a content of what is held, or neither."""
        self.held.pop(object_id, None)
        self.held_contents.pop(object_id, None)
