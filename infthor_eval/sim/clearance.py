"""Whether there is room for an object somewhere, by the boxes of all others."""

from collections.abc import Iterator

import numpy as np

from infthor_eval.sim.geometry import Array, aabb_overlap
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.world import World

__all__ = ["obstacle_at"]

_SKIN = 0.005  # metres by which boxes may overlap: things that touch do


def obstacle_at(world: World, item: SimObject, offset: Array) -> str | None:
    """Name of what an object would run into if it were moved by `offset` (3,); None for nothing.

    What it is already in or touches does not hold it: it could not be got away otherwise.
    """
    low, high = item.bounds()
    low, high = low + _SKIN, high - _SKIN
    room_low, room_high = world.scene_bounds()
    if np.any(low + offset < room_low) or np.any(high + offset > room_high):
        return "Wall"
    for other in _solid(world, item):
        o_low, o_high = _body(other)
        if aabb_overlap(low + offset, high + offset, o_low, o_high) and not aabb_overlap(low, high, o_low, o_high):
            return other.name
    return None


def _solid(world: World, item: SimObject) -> Iterator[SimObject]:
    """What is in the way of an object; not its own contents, nor the inside of what is open."""
    own = {o.object_id for o in world.descendants(item)} | {item.object_id}
    if world.held is not None and item.object_id != world.held:
        own |= {world.held, *(o.object_id for o in world.descendants(world.objects[world.held]))}
    for other in world.objects.values():
        if not (other.object_id in own or _open_inside(other) or world.hidden(other) or other.object_type == "Floor"):
            yield other


def _open_inside(other: SimObject) -> bool:
    """Whether there may be room within the box of an object."""
    if other.type.encloses and other.type.openable:
        return other.state.openness > 0
    return bool(other.type.open_top > 0 or other.type.levels or other.pieces)


def _body(other: SimObject) -> tuple[Array, Array]:
    """Low and high corner of an object; of a seat or desk, of what is below the surface that things stand on."""
    low, high = other.bounds()
    if other.type.receptacle and other.support is not None:
        high = np.array([high[0], other.surface_height(), high[2]])
    return low, high
