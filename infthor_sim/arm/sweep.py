"""Collision checks of an arm, and of the agent with its arm, along a path of small steps."""

from dataclasses import dataclass

import numpy as np

from infthor_sim.arm.arm import Arm, Transform, base_transforms
from infthor_sim.arm.boxes import Boxes, join, separations
from infthor_sim.arm.obstacles import ArmObstacles
from infthor_sim.arm.rig import ArmPose
from infthor_sim.geometry import Array
from infthor_sim.world import World

_SKIN = 0.001  # metres that boxes may overlap, as those of objects that touch do
_STUCK = 0.02  # metres of overlap from which a part of the arm counts as stuck in an object
_SAME = 1e-9  # metres of rounding


@dataclass(frozen=True)
class Stance:
    """A pose of the agent and of its arm.

    Attributes:
        position: position of the agent, metres (3,).
        yaw: direction of the agent, degrees.
        pose: pose of the arm.
    """

    position: Array
    yaw: float
    pose: ArmPose


def stance(world: World, arm: Arm) -> Stance:
    """Return the agent's present stance."""
    return Stance(world.agent.position, world.agent.yaw, arm.pose)


def take_stance(world: World, arm: Arm, to: Stance) -> None:
    """Bring the agent and its arm to a stance, with everything held."""
    world.agent.position = to.position
    world.agent.yaw = to.yaw
    arm.change(to.pose)
    world.carry(keep_grip=True)


def first_contact(
    world: World, arm: Arm, path: list[Stance], around: ArmObstacles
) -> tuple[int, str] | None:
    """Return the index of the first stance in which arm or load is in something, and its name.

    What the arm touches already is in the way only where the same part of the arm gets deeper into
    it. A part that is stuck in an object, as after a teleport, may leave it any way: there only the
    end of the path counts.

    None if the whole path is free; it begins after the present stance.
    """
    moving = moving_boxes(world, arm, [stance(world, arm), *path])
    low, high = moving.bounds()
    near = around.near(low.min(axis=(0, 1)), high.max(axis=(0, 1)))
    if not len(near.owner):
        return None
    # Gaps by stance, part of the arm and object: an object of many primitives counts by its nearest
    # one, so that the arm may slide along it from one primitive to the next.
    gaps = separations(moving.flat(), near.boxes).reshape(len(path) + 1, -1, len(near.owner))
    owners = np.unique(near.owner)
    gaps = np.stack([gaps[:, :, near.owner == owner].min(axis=2) for owner in owners], axis=2)
    # Negative where a part is deeper in an object than at the start, where `_SKIN` is always
    # allowed.
    depth = gaps[1:] - np.minimum(gaps[0], -_SKIN)
    depth[:-1, gaps[0] < -_STUCK] = 0.0
    hit = np.flatnonzero(depth.min(axis=(1, 2)) < -_SAME)
    if not len(hit):
        return None
    step = int(hit[0])
    return step, near.names[owners[depth[step].min(axis=0).argmin()]]


def is_free(world: World, arm: Arm, there: Stance, around: ArmObstacles) -> bool:
    """Return whether arm and held objects are in nothing in a stance, wherever they are now."""
    gaps = separations(moving_boxes(world, arm, [there]).flat(), around.boxes)
    return bool((gaps >= -_SKIN).all())


def moving_boxes(world: World, arm: Arm, stances: list[Stance]) -> Boxes:
    """Return the boxes (stances, n) of the arm and of what it holds, in the world."""
    positions = np.stack([s.position for s in stances])
    yaws = np.array([s.yaw for s in stances])
    origins, turns = base_transforms(arm.rig, positions, yaws, [s.pose for s in stances])
    # While the agent walks or turns its arm keeps one pose: its boxes are computed once, and only
    # moved.
    poses = (
        [stances[0].pose]
        if all(s.pose is stances[0].pose for s in stances)
        else [s.pose for s in stances]
    )
    wrists = np.stack([p.wrist for p in poses])
    twists = np.stack([p.turn for p in poses])
    held = _held_boxes(world, arm).transform(wrists, twists)
    return join([arm.rig.boxes(poses), held], axis=1).transform(origins, turns)


def _held_boxes(world: World, arm: Arm) -> Boxes:
    """Return the boxes (n,) of what moves with the hand, in the wrist's frame."""
    held = [
        (Transform(grip.offset, grip.turn), world.objects[object_id])
        for object_id, grip in arm.grips()
    ]
    return Boxes(
        np.array([frame.point(item.box_center) for frame, item in held]).reshape(-1, 3),
        np.array([frame.turn.T for frame, _ in held]).reshape(-1, 3, 3),
        np.array([item.box_size / 2 for _, item in held]).reshape(-1, 3),
    )
