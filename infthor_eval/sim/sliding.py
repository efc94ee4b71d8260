"""Objects that slide over what they stand on."""

from infthor_eval.sim.clearance import obstacle_at
from infthor_eval.sim.falling import assign_parent, let_fall
from infthor_eval.sim.geometry import Array
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.world import World

__all__ = ["slide"]

_STEP = 0.02  # metres between two collision checks
_FARTHEST = 5.0  # metres; no room is much larger, and a strong push of a light object would go on for kilometres


def slide(world: World, item: SimObject, direction: Array, distance: float) -> None:
    """Move an object, with its contents, along `direction` (3,) for at most `distance` metres.

    It stops at an obstacle and at the walls of something closed. Once its middle is beyond the edge of what it stands
    on, it falls.
    """
    support = None if item.parent is None else world.objects[item.parent]
    for _ in range(int(min(distance, _FARTHEST) / _STEP)):
        at_wall = support is not None and world.is_hidden(item) and _is_beyond(support, item.center + direction * _STEP)
        if at_wall or obstacle_at(world, item, direction * _STEP) is not None:
            break
        world.shift([item], direction * _STEP)
        if support is not None and _is_beyond(support, item.center):
            let_fall(world, item, item.center)
            return
    if item.type.pickupable:
        assign_parent(world, item)


def _is_beyond(support: SimObject, point: Array) -> bool:
    low, high = support.bounds()
    return not (low[0] <= point[0] <= high[0] and low[2] <= point[2] <= high[2])
