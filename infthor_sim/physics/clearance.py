"""Checks for free room for an object, against the boxes of all others."""

from collections.abc import Iterator

import numpy as np

from infthor_sim.geometry import Array, aabb_overlap
from infthor_sim.objects import SimObject
from infthor_sim.physics.receptacles import contains_box
from infthor_sim.world import World

_SKIN = 0.005  # metres by which boxes may overlap: things that touch do


def obstacle_at(world: World, item: SimObject, offset: Array) -> str | None:
    """Return the name of what an object would hit if moved by `offset` (3,); None: nothing.

    What it touches already does not count, as the object could not be moved away from it otherwise.
    """
    return next(obstacles_at(world, item, offset), None)


def obstacles_at(world: World, item: SimObject, offset: Array) -> Iterator[str]:
    """Yield the names of all that an object would hit if moved by `offset` (3,)."""
    low, high = item.bounds()
    for name, box in _collisions(world, item, low + offset, high + offset):
        if not _overlaps(low, high, box):
            yield name


def occupant(world: World, pose: SimObject) -> str | None:
    """Return the name of what is in the way of an object's copy in another pose, or None."""
    return next((name for name, _ in _collisions(world, pose, *pose.bounds())), None)


def _collisions(
    world: World, item: SimObject, low: Array, high: Array
) -> Iterator[tuple[str, tuple[Array, Array]]]:
    """Yield the names and boxes of what a box of an object, given by its corners, overlaps."""
    room_low, room_high = world.scene_bounds()
    if np.any(low + _SKIN < room_low) or np.any(high - _SKIN > room_high):
        # An empty box, which overlaps nothing: being in a wall already is no excuse to go into it.
        yield "Wall", (np.full(3, np.inf), np.full(3, -np.inf))
    for other in _obstacles(world, item):
        box = _solid_box(other)
        if _overlaps(low, high, box) and not contains_box(other, low + _SKIN, high - _SKIN):
            yield other.name, box


def _overlaps(low: Array, high: Array, box: tuple[Array, Array]) -> bool:
    return aabb_overlap(low + _SKIN, high - _SKIN, *box)


def _obstacles(world: World, item: SimObject) -> Iterator[SimObject]:
    """Yield what may be in an object's way: not contents, held things, furniture with room."""
    own = {o.object_id for o in world.descendants(item)} | {item.object_id}
    for held in world.held_ids():
        own |= {held, *(o.object_id for o in world.descendants(world.objects[held]))}
    for other in world.objects.values():
        if not (
            other.object_id in own
            or _has_room(other)
            or world.is_hidden(other)
            or other.object_type == "Floor"
        ):
            yield other


def _has_room(other: SimObject) -> bool:
    """Return whether a piece of furniture may have room in its box, and so stops nothing."""
    if other.type.pickupable:
        return False
    if other.type.encloses and other.type.openable:
        return other.state.openness > 0
    return bool(other.type.open_top > 0 or other.type.levels or other.pieces)


def _solid_box(other: SimObject) -> tuple[Array, Array]:
    """Return the corners of an object's box; of a seat or desk the part below its surface."""
    low, high = other.bounds()
    if other.type.receptacle and other.support is not None and not other.type.encloses:
        high = np.array([high[0], other.surface_height(), high[2]])
    return low, high
