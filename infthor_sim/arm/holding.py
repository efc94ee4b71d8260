"""Picking up what the hand's sphere touches, and dropping it."""

from typing import NamedTuple

import numpy as np

from infthor_sim.agent import Grip
from infthor_sim.arm.arm import Arm, Transform
from infthor_sim.arm.boxes import Boxes, sphere_gaps
from infthor_sim.geometry import Array, matrix_euler
from infthor_sim.objects import SimObject
from infthor_sim.physics.falling import let_fall
from infthor_sim.world import World


class TouchedObjects(NamedTuple):
    """Objects that the hand's sphere touches and the arm does not hold, in the metadata's order.

    Attributes:
        pickupable: objects that can be picked up.
        loose: those, and furniture that can be moved.
    """

    pickupable: list[SimObject]
    loose: list[SimObject]


def touched_objects(world: World, arm: Arm) -> TouchedObjects:
    """Return what the hand's sphere touches, without what is inside something closed."""
    center = arm.sphere(world.agent)
    loose = [
        o
        for o in world.objects.values()
        if (o.type.pickupable or o.type.moveable) and o.object_id not in arm.held
    ]
    near = [o for o in loose if _is_near(o, center, arm.radius) and not world.is_hidden(o)]
    return TouchedObjects([o for o in near if o.type.pickupable], near)


def _is_near(item: SimObject, center: Array, radius: float) -> bool:
    low, high = item.bounds()
    for axis in range(3):  # most objects are far away, and this sorts them out quickest
        if not low[axis] - radius <= center[axis] <= high[axis] + radius:
            return False
    box = Boxes(item.center[None], item.matrix.T[None], item.box_size[None] / 2)
    return bool(sphere_gaps(box, center)[0] <= radius)


def pick_up(world: World, arm: Arm, things: list[SimObject]) -> None:
    """Hold some objects where they are; their contents move with them."""
    wrist = arm.wrist(world.agent)
    held = {*arm.held, *(o.object_id for o in things)}
    for item in things:
        if item.parent not in held:  # a spoon stays a content of the bowl if both are held
            world.detach(item)
        item.state.picked_up = True
        arm.let_go(item.object_id)
        arm.held[item.object_id] = _grip(wrist, item)
        inside = [o for o in world.descendants(item) if o.object_id not in held]
        arm.held_contents.update({o.object_id: _grip(wrist, o) for o in inside})
        world.mark_changed(item)
    arm.version += 1


def _grip(wrist: Transform, item: SimObject) -> Grip:
    return Grip(wrist.local(item.position), wrist.turn.T @ item.matrix)


def drop_all(world: World, arm: Arm) -> None:
    """Let go of everything: each object falls, lies flat, and belongs to what it lies in or on."""
    held = [world.objects[object_id] for object_id in arm.held]
    # Contents fall with their dish. The lowest goes first, so that others can land on it.
    outermost = [o for o in held if o.parent not in arm.held]
    world.release()
    arm.version += 1
    for item in sorted(outermost, key=lambda o: float(o.bounds()[0][1])):
        middle = item.center
        turn = matrix_euler(_level_rotation(item.matrix))
        world.set_pose(item, item.position, turn)
        # it turns about its middle and not about its origin
        world.shift([item], middle - item.center)
        let_fall(world, item, item.center)


def _level_rotation(matrix: Array) -> Array:
    """Return the rotation (3, 3) nearest to another in which one axis of the box is upright."""
    # The axis nearest to the vertical is turned onto it the shortest way, about the level axis at
    # right angles to both (Rodrigues' formula with the sine in the axis' length).
    axis = int(np.argmax(np.abs(matrix[1])))
    upright = matrix[:, axis] * np.sign(matrix[1, axis])
    about = np.cross(upright, (0.0, 1.0, 0.0))
    skew = np.array(
        [[0.0, -about[2], about[1]], [about[2], 0.0, -about[0]], [-about[1], about[0], 0.0]]
    )
    turned: Array = (np.eye(3) + skew + skew @ skew / (1.0 + upright[1])) @ matrix
    return turned
