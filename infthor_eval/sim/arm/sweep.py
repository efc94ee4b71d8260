"""Moving an arm, or the agent with its arm, along a path of small steps until something is in the way."""

from dataclasses import dataclass

import numpy as np

from infthor_eval.sim.arm.arm import Arm, Frame, base_frames
from infthor_eval.sim.arm.boxes import Boxes, join, separations
from infthor_eval.sim.arm.rig import ArmPose
from infthor_eval.sim.arm.surroundings import Solids
from infthor_eval.sim.geometry import Array
from infthor_eval.sim.world import World

__all__ = ["Stance", "assume", "first_contact", "free", "moving_boxes", "stance"]

_SKIN = 0.001  # metres that boxes may overlap: things that touch do
_STUCK = 0.02  # metres deep from which a part of the arm does not touch a thing but is in it
_SAME = 1e-9  # metres of rounding


@dataclass(frozen=True)
class Stance:
    """Where the agent stands, which way it looks (degrees), and how its arm is bent."""

    position: Array
    yaw: float
    pose: ArmPose


def stance(world: World, arm: Arm) -> Stance:
    """How the agent stands now."""
    return Stance(world.agent.position, world.agent.yaw, arm.pose)


def assume(world: World, arm: Arm, to: Stance) -> None:
    """Bring the agent and its arm to a stance, with all that it holds."""
    world.agent.position, world.agent.yaw = to.position, to.yaw
    arm.change(to.pose)
    world.carry(keep_grip=True)


def first_contact(world: World, arm: Arm, path: list[Stance], around: Solids) -> tuple[int, str] | None:
    """The first of some stances (n) in which the arm, or what it holds, is in something: its index, and what that is.

    The path begins where the agent is now. A thing that is touched there is in the way only where the same part of the
    arm gets deeper into it than it is: it could not be got away otherwise. What is stuck in a thing, as after a
    teleport, may leave it through other parts of it: there the end of the path counts alone.

    Returns:
        None where the whole path is free.
    """
    moving = moving_boxes(world, arm, [stance(world, arm), *path])
    low, high = moving.bounds()
    met = around.near(low.min(axis=(0, 1)), high.max(axis=(0, 1)))
    if not len(met.owner):
        return None
    gaps = separations(moving.flat(), met.boxes).reshape(len(path) + 1, -1, len(met.owner))
    things = np.unique(met.owner)
    gaps = np.stack([gaps[:, :, met.owner == thing].min(axis=2) for thing in things], axis=2)
    depth = gaps[1:] - np.minimum(gaps[0], -_SKIN)
    depth[:-1, gaps[0] < -_STUCK] = 0.0
    hit = np.flatnonzero(depth.min(axis=(1, 2)) < -_SAME)
    if not len(hit):
        return None
    step = int(hit[0])
    return step, met.names[things[depth[step].min(axis=0).argmin()]]


def free(world: World, arm: Arm, there: Stance, around: Solids) -> bool:
    """Whether the arm, and what it holds, is in nothing in a stance, wherever it is now."""
    gaps = separations(moving_boxes(world, arm, [there]).flat(), around.boxes)
    return bool((gaps >= -_SKIN).all())


def moving_boxes(world: World, arm: Arm, stances: list[Stance]) -> Boxes:
    """The boxes (stances, n) of the arm and of what it holds, in the world."""
    positions, yaws = np.stack([s.position for s in stances]), np.array([s.yaw for s in stances])
    origins, turns = base_frames(arm.rig, positions, yaws, [s.pose for s in stances])
    poses = [stances[0].pose] if all(s.pose is stances[0].pose for s in stances) else [s.pose for s in stances]
    wrists, twists = np.stack([p.wrist for p in poses]), np.stack([p.turn for p in poses])
    return join([arm.rig.boxes(poses), _freight(world, arm).moved(wrists, twists)], axis=1).moved(origins, turns)


def _freight(world: World, arm: Arm) -> Boxes:
    """The boxes (n,) of what moves with the hand, in the wrist's frame."""
    held = [(Frame(grip.offset, grip.turn), world.objects[object_id]) for object_id, grip in arm.grips()]
    return Boxes(
        np.array([frame.point(item.box_center) for frame, item in held]).reshape(-1, 3),
        np.array([frame.turn.T for frame, _ in held]).reshape(-1, 3, 3),
        np.array([item.box_size / 2 for _, item in held]).reshape(-1, 3),
    )
