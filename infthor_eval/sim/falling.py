"""What becomes of things that nothing holds: they fall to what is below them, and may break."""

import numpy as np

from infthor_eval.sim.effects import break_object
from infthor_eval.sim.geometry import Array
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.receptacles import owner_of
from infthor_eval.sim.world import World

__all__ = ["let_fall", "settle_in"]

_BREAKING = 0.9  # metres of fall that break a breakable thing


def let_fall(world: World, item: SimObject, point: Array) -> None:
    """Drop an object, which nothing holds any more, from its height to what is below `point` (3,), within the room."""
    low, high = world.scene_bounds()
    margin = item.box_size.max() / 2
    inside = np.clip(point, np.add(low, (margin, 0, margin)), np.subtract(high, (margin, 0, margin)))
    pose = item.duplicate(item.object_id)
    pose.place_bottom(np.array([inside[0], _ground(world, item, inside), inside[2]]))
    fall = float(item.bounds()[0][1] - pose.bounds()[0][1])
    world.set_pose(item, pose.position, pose.rotation)
    settle_in(world, item)
    if item.type.breakable and not item.state.broken and fall > _BREAKING:
        break_object(world, item)


def settle_in(world: World, item: SimObject) -> None:
    """Make an object one of the contents of whatever it stands in or on now."""
    world.detach(item)
    owner = owner_of(world, item)
    if owner is not None:
        world.attach(item, owner)


def _ground(world: World, item: SimObject, point: Array) -> float:
    """Height of the highest surface under `point` that is below the object; 0 is the floor."""
    best = 0.0
    bottom = item.bounds()[0][1]
    for other in world.objects.values():
        if other is item or other.type.pickupable or not other.type.receptacle or other.type.encloses:
            continue
        low, high = other.bounds()
        height = other.surface_height()
        inside = low[0] <= point[0] <= high[0] and low[2] <= point[2] <= high[2]
        if inside and best < height <= bottom:
            best = height
    return best
