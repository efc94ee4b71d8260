"""Objects that slide over what they stand on."""

from infthor_eval.sim.clearance import obstacle_at
from infthor_eval.sim.falling import assign_parent, is_over, let_fall
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
    step = direction * _STEP
    for _ in range(int(min(distance, _FARTHEST) / _STEP)):
        at_wall = support is not None and world.is_hidden(item) and not is_over(support, item.center + step)
        if at_wall or obstacle_at(world, item, step) is not None:
            break
        world.shift([item], step)
        if support is not None and not is_over(support, item.center):
            let_fall(world, item, item.center)
            return
    if item.type.pickupable:
        assign_parent(world, item)
