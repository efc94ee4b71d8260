"""Objects that slide over what they stand on."""

from infthor_sim.geometry import Array
from infthor_sim.objects import SimObject
from infthor_sim.physics.clearance import obstacles_at
from infthor_sim.physics.falling import assign_parent, is_over, let_fall
from infthor_sim.world import World

_STEP = 0.02  # metres between two collision checks
LIGHTEST = 0.05  # kilograms; some recorded objects have a mass of 0
# metres; no room is much larger, and a strong push of a light object would go on for kilometres
_FARTHEST = 5.0


def slide(world: World, item: SimObject, direction: Array, distance: float) -> None:
    """Move an object, with its contents, along `direction` (3,) for at most `distance` metres.

    It takes loose things in its way along, which costs it way in proportion to their masses. It
    stops at anything else and at the walls of something closed. What is then beyond the edge of
    what it stands on falls.
    """
    step = direction * _STEP
    left = min(distance, _FARTHEST)
    moved = {item.object_id: item}
    while left >= _STEP:
        pushed = _pushed(world, item, step, {})
        if pushed is None:
            break
        moved |= pushed
        world.shift(pushed.values(), step)
        left -= (
            _STEP
            * sum(max(o.type.mass, LIGHTEST) for o in pushed.values())
            / max(item.type.mass, LIGHTEST)
        )
        support = _support(world, item)
        if support is not None and not is_over(support, item.center):
            break
    for other in moved.values():
        support = _support(world, other)
        if support is not None and not is_over(support, other.center):
            let_fall(world, other, other.center)
        elif other.type.pickupable:
            assign_parent(world, other)


def _support(world: World, item: SimObject) -> SimObject | None:
    return None if item.parent is None else world.objects[item.parent]


def _pushed(
    world: World, item: SimObject, step: Array, pushed: dict[str, SimObject]
) -> dict[str, SimObject] | None:
    """Return an object and the loose things it takes along, by id; None if one is stopped."""
    support = _support(world, item)
    if support is not None and world.is_hidden(item) and not is_over(support, item.center + step):
        return None  # the wall of something closed
    pushed = {**pushed, item.object_id: item}
    for name in obstacles_at(world, item, step):
        other = next((o for o in world.objects.values() if o.name == name), None)
        if other is None or not other.type.pickupable:
            return None
        if other.object_id in pushed:
            continue
        further = _pushed(world, other, step, pushed)
        if further is None:
            return None
        pushed = further
    return pushed
