"""Falling: an object that nothing holds drops straight down onto what is below, and may break."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from infthor_sim.effects import break_object
from infthor_sim.geometry import Array, yaw_matrix
from infthor_sim.objects import SimObject
from infthor_sim.physics.receptacles import Surface, find_parent, surfaces
from infthor_sim.world import World

_BREAKING = 0.9  # metres of fall that break a breakable thing
# metres that an object may already be below what it falls on: it was pushed along it, or lay in it
_SUNK = 0.03


class _Landing(NamedTuple):
    """A place that an object may fall on.

    Attributes:
        height: world height, metres.
        parent: receptacle that the object belongs to there; None for none.
    """

    height: float
    parent: SimObject | None


def let_fall(world: World, item: SimObject, point: Array) -> None:
    """Drop a released object to what is below `point` (3,), which is first moved into the room.

    The object then belongs to the receptacle that it fell into or onto; on another loose object, to
    that one's receptacle.
    """
    low, high = world.scene_bounds()
    margin = item.box_size.max() / 2
    inside = np.clip(
        point, np.add(low, (margin, 0, margin)), np.subtract(high, (margin, 0, margin))
    )
    landing = max(_landings(world, item, inside), key=_rank, default=_floor(world, inside))
    pose = item.duplicate(item.object_id)
    pose.place_bottom(np.array([inside[0], landing.height, inside[2]]))
    fall = float(item.bounds()[0][1] - pose.bounds()[0][1])
    world.set_pose(item, pose.position, pose.rotation)
    world.detach(item)
    if landing.parent is not None:
        world.attach(item, landing.parent)
    breakable = item.type.breakable and not item.unbreakable
    if breakable and not item.state.broken and fall > _BREAKING:
        break_object(world, item)


def assign_parent(world: World, item: SimObject) -> None:
    """Make an object a content of whatever it is in or on now."""
    world.detach(item)
    parent = find_parent(world, item)
    if parent is not None:
        world.attach(item, parent)


def _floor(world: World, point: Array) -> _Landing:
    below = (o for o in world.objects.values() if o.object_type == "Floor" and is_over(o, point))
    return _Landing(0.0, next(below, None))


def _landings(world: World, item: SimObject, point: Array) -> Iterator[_Landing]:
    """Yield the places below `point` and below the object."""
    bottom = float(item.bounds()[0][1])
    basins = [
        o
        for o in world.objects.values()
        if o.type.basin and o.type.open_top and _is_above(surfaces(o)[0], point)
    ]
    aside = {item.object_id, *(o.object_id for o in world.descendants(item)), *world.held_ids()}
    for other in world.objects.values():
        gone = other.object_id in aside or other.object_type == "Floor" or world.is_hidden(other)
        if gone or not (other.type.receptacle or other.type.pickupable):
            continue
        for landing in _landings_on(
            world, item, other, point, bottom, has_top=not _has_basin(other, basins)
        ):
            if 0.0 < landing.height <= bottom + _SUNK:
                yield landing


def _rank(landing: _Landing) -> float:
    """Return a landing's height; a dish ranks above what it stands on, even if a bit lower."""
    dish = landing.parent is not None and landing.parent.type.pickupable
    return landing.height + (_SUNK if dish else 0.0)


def _landings_on(
    world: World, item: SimObject, other: SimObject, point: Array, bottom: float, *, has_top: bool
) -> Iterator[_Landing]:
    """Yield landings on and in `other` below `point` (3,), for an underside at height `bottom`.

    `has_top`: `other` has an upper side at `point`, and not the hole for a basin.
    """
    if not has_top and not other.type.encloses:
        return
    closed = other.type.encloses and other.type.openable and other.state.openness == 0
    open_surfaces = surfaces(other) if other.type.receptacle and not closed else []
    # The object must come from below the next shelf. A drawer has none above it where it has come
    # out.
    reached = [
        s for s in open_surfaces if _is_above(s, point) and _fits(item, other, s)
        and (other.type.slides or bottom <= float(s.center[1]) + s.headroom)
    ]  # fmt: skip
    yield from (_Landing(float(surface.center[1]), other) for surface in reached)
    has_top = has_top and other.type.encloses and not other.type.slides
    if not reached and (has_top or other.type.pickupable) and is_over(other, point):
        # It lies on top: of what is closed or full of shelves, or across a loose object and so
        # where that one lies.
        parent = (
            world.objects[other.parent]
            if other.type.pickupable and other.parent is not None
            else None
        )
        yield _Landing(float(other.bounds()[1][1]), parent)


def _has_basin(other: SimObject, basins: list[SimObject]) -> bool:
    """Return whether a piece of furniture has one of some basins let into its surface."""
    if other.type.pickupable or other.type.open_top:
        return False
    low, high = other.bounds()
    return any(
        np.all(basin.center > low - _SUNK) and np.all(basin.center < high + _SUNK)
        for basin in basins
    )


def _is_above(surface: Surface, point: Array) -> bool:
    """Return whether a point is within a surface's edges, at any height."""
    local = np.abs(yaw_matrix(surface.yaw).T @ (point - surface.center))
    return bool(local[0] <= surface.half[0] and local[2] <= surface.half[1])


def _fits(item: SimObject, vessel: SimObject, surface: Surface) -> bool:
    """Return whether an object goes into a vessel; always True for what is not hollow."""
    if not vessel.type.open_top:
        return True
    low, high = item.bounds()
    return bool(min(high[0] - low[0], high[2] - low[2]) <= 2 * max(surface.half))


def is_over(other: SimObject, point: Array) -> bool:
    """Return whether a point is within an object's outline from above, at any height."""
    low, high = other.bounds()
    return bool(low[0] <= point[0] <= high[0] and low[2] <= point[2] <= high[2])
