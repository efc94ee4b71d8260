"""What the hand's sphere meets, picking that up, and letting it fall."""

from typing import NamedTuple

import numpy as np

from infthor_eval.sim.agent import Grip
from infthor_eval.sim.arm.arm import Arm, Frame
from infthor_eval.sim.arm.boxes import Boxes, sphere_gaps
from infthor_eval.sim.falling import let_fall
from infthor_eval.sim.geometry import Array, matrix_euler
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.world import World

__all__ = ["Touched", "drop_all", "pick_up", "touched"]


class Touched(NamedTuple):
    """What the hand's sphere meets and the arm does not hold, in the order of the metadata.

    Attributes:
        pickupable: things that can be picked up.
        loose: those, and furniture that can be moved.
    """

    pickupable: list[SimObject]
    loose: list[SimObject]


def touched(world: World, arm: Arm) -> Touched:
    """What the hand's sphere meets; not what is shut in, nor what the arm holds."""
    center = arm.sphere(world.agent)
    loose = [
        o for o in world.objects.values() if (o.type.pickupable or o.type.moveable) and o.object_id not in arm.held
    ]
    near = [o for o in loose if _near(o, center, arm.radius) and not world.hidden(o)]
    return Touched([o for o in near if o.type.pickupable], near)


def _near(item: SimObject, center: Array, radius: float) -> bool:
    low, high = item.bounds()
    for axis in range(3):  # most things are far away: this is the quickest way to tell
        if not low[axis] - radius <= center[axis] <= high[axis] + radius:
            return False
    box = Boxes(item.center[None], item.matrix.T[None], item.box_size[None] / 2)
    return bool(sphere_gaps(box, center)[0] <= radius)


def pick_up(world: World, arm: Arm, things: list[SimObject]) -> None:
    """Hold some things where they are; what is in them comes along."""
    wrist = arm.wrist(world.agent)
    held = {*arm.held, *(o.object_id for o in things)}
    for item in things:
        if item.parent not in held:
            world.detach(item)
        item.state.picked_up = True
        arm.let_go(item.object_id)
        arm.held[item.object_id] = _grip(wrist, item)
        inside = [o for o in world.descendants(item) if o.object_id not in held]
        arm.freight.update({o.object_id: _grip(wrist, o) for o in inside})
        world.touch(item)
    arm.version += 1


def _grip(wrist: Frame, item: SimObject) -> Grip:
    return Grip(wrist.local(item.position), wrist.turn.T @ item.matrix)


def drop_all(world: World, arm: Arm) -> None:
    """Let go of everything: each thing falls, comes to lie flat, and belongs to what it lies in or on."""
    held = [world.objects[object_id] for object_id in arm.held]
    outermost = [o for o in held if o.parent not in arm.held]
    world.release()
    arm.version += 1
    for item in sorted(outermost, key=lambda o: float(o.bounds()[0][1])):
        middle = item.center
        turn = matrix_euler(_flat(item.matrix))
        world.set_pose(item, item.position, turn)
        world.shift([item], middle - item.center)
        let_fall(world, item, item.center)


def _flat(matrix: Array) -> Array:
    """The rotation (3, 3) nearest to another in which one axis of the box is upright."""
    axis = int(np.argmax(np.abs(matrix[1])))
    upright = matrix[:, axis] * np.sign(matrix[1, axis])
    about = np.cross(upright, (0.0, 1.0, 0.0))
    skew = np.array([[0.0, -about[2], about[1]], [about[2], 0.0, -about[0]], [-about[1], about[0], 0.0]])
    turned: Array = (np.eye(3) + skew + skew @ skew / (1.0 + upright[1])) @ matrix
    return turned
