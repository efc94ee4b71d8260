"""Whether there is room for an object somewhere, by the boxes of all others."""

from collections.abc import Iterator

import numpy as np

from infthor_eval.sim.geometry import Array, aabb_overlap
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.receptacles import has_within
from infthor_eval.sim.world import World

__all__ = ["obstacle_at", "occupant"]

_SKIN = 0.005  # metres by which boxes may overlap: things that touch do


def obstacle_at(world: World, item: SimObject, offset: Array) -> str | None:
    """Name of what an object would run into if it were moved by `offset` (3,); None for nothing.

    What it is already in or touches does not hold it: it could not be got away otherwise.
    """
    low, high = item.bounds()
    for name, box in _met(world, item, low + offset, high + offset):
        if not _overlap(low, high, box):
            return name
    return None


def occupant(world: World, pose: SimObject) -> str | None:
    """Name of what is where an object would be in another pose, given as a copy of it; None for nothing."""
    return next((name for name, _ in _met(world, pose, *pose.bounds())), None)


def _met(world: World, item: SimObject, low: Array, high: Array) -> Iterator[tuple[str, tuple[Array, Array]]]:
    """What the box of an object, somewhere, overlaps: names and boxes."""
    room_low, room_high = world.scene_bounds()
    if np.any(low + _SKIN < room_low) or np.any(high - _SKIN > room_high):
        yield "Wall", (np.full(3, np.inf), np.full(3, -np.inf))
    for other in _solid(world, item):
        box = _body(other)
        if _overlap(low, high, box) and not has_within(other, low + _SKIN, high - _SKIN):
            yield other.name, box


def _overlap(low: Array, high: Array, box: tuple[Array, Array]) -> bool:
    return aabb_overlap(low + _SKIN, high - _SKIN, *box)


def _solid(world: World, item: SimObject) -> Iterator[SimObject]:
    """What is in the way of an object; not its own contents, nor the inside of what is open."""
    own = {o.object_id for o in world.descendants(item)} | {item.object_id}
    for held in world.carried():
        own |= {held, *(o.object_id for o in world.descendants(world.objects[held]))}
    for other in world.objects.values():
        if not (other.object_id in own or _open_inside(other) or world.hidden(other) or other.object_type == "Floor"):
            yield other


def _open_inside(other: SimObject) -> bool:
    """Whether there may be room within the box of a piece of furniture."""
    if other.type.pickupable:
        return False
    if other.type.encloses and other.type.openable:
        return other.state.openness > 0
    return bool(other.type.open_top > 0 or other.type.levels or other.pieces)


def _body(other: SimObject) -> tuple[Array, Array]:
    """Low and high corner of an object; of a seat or desk, of what is below the surface that things stand on."""
    low, high = other.bounds()
    if other.type.receptacle and other.support is not None:
        high = np.array([high[0], other.surface_height(), high[2]])
    return low, high
