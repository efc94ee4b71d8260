"""What becomes of things that nothing holds: they fall to what is below them, and may break."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from infthor_eval.sim.effects import break_object
from infthor_eval.sim.geometry import Array, yaw_matrix
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.receptacles import Surface, owner_of, surfaces
from infthor_eval.sim.world import World

__all__ = ["let_fall", "settle_in"]

_BREAKING = 0.9  # metres of fall that break a breakable thing
_SUNK = 0.03  # metres that a thing may already be below what it falls on: it was drawn along it, or lay in it


class _Ground(NamedTuple):
    """What a thing falls on: its height in metres, and what the thing then belongs to."""

    height: float
    owner: SimObject | None


def let_fall(world: World, item: SimObject, point: Array) -> None:
    """Drop an object, which nothing holds any more, from its height to what is below `point` (3,), within the room.

    It belongs then to the receptacle that it fell into or onto; on another loose thing, to the receptacle of that.
    """
    low, high = world.scene_bounds()
    margin = item.box_size.max() / 2
    inside = np.clip(point, np.add(low, (margin, 0, margin)), np.subtract(high, (margin, 0, margin)))
    ground = max(_grounds(world, item, inside), key=_upmost, default=_floor(world, inside))
    pose = item.duplicate(item.object_id)
    pose.place_bottom(np.array([inside[0], ground.height, inside[2]]))
    fall = float(item.bounds()[0][1] - pose.bounds()[0][1])
    world.set_pose(item, pose.position, pose.rotation)
    world.detach(item)
    if ground.owner is not None:
        world.attach(item, ground.owner)
    breakable = item.type.breakable and item.object_type not in world.unbreakable
    if breakable and not item.state.broken and fall > _BREAKING:
        break_object(world, item)


def settle_in(world: World, item: SimObject) -> None:
    """Make an object one of the contents of whatever it stands in or on now."""
    world.detach(item)
    owner = owner_of(world, item)
    if owner is not None:
        world.attach(item, owner)


def _floor(world: World, point: Array) -> _Ground:
    below = (o for o in world.objects.values() if o.object_type == "Floor" and _over(o, point))
    return _Ground(0.0, next(below, None))


def _grounds(world: World, item: SimObject, point: Array) -> Iterator[_Ground]:
    """What is below `point` and below the object."""
    bottom = float(item.bounds()[0][1])
    basins = [o for o in world.objects.values() if o.type.basin and o.type.open_top and _under(surfaces(o)[0], point)]
    aside = {item.object_id, *(o.object_id for o in world.descendants(item)), *world.carried()}
    for other in world.objects.values():
        gone = other.object_id in aside or other.object_type == "Floor" or world.hidden(other)
        if gone or not (other.type.receptacle or other.type.pickupable):
            continue
        for ground in _on(world, item, other, point, bottom, topped=not _cut_out(other, basins)):
            if 0.0 < ground.height <= bottom + _SUNK:
                yield ground


def _upmost(ground: _Ground) -> float:
    """By what a ground is above others: its height, but a dish is above what it stands on, however it is drawn."""
    dish = ground.owner is not None and ground.owner.type.pickupable
    return ground.height + (_SUNK if dish else 0.0)


def _on(
    world: World, item: SimObject, other: SimObject, point: Array, bottom: float, *, topped: bool
) -> Iterator[_Ground]:
    """Where on or in another thing an object may come to lie; what is not `topped` has no surface but those within."""
    if not topped and not other.type.encloses:
        return
    closed = other.type.encloses and other.type.openable and other.state.openness == 0
    open_surfaces = surfaces(other) if other.type.receptacle and not closed else []
    reached = [s for s in open_surfaces if _under(s, point) and _fits(item, other, s) and _open_above(other, s, bottom)]
    yield from (_Ground(float(surface.center[1]), other) for surface in reached)
    topped = topped and other.type.encloses and not other.type.slides
    if not reached and (topped or other.type.pickupable) and _over(other, point):
        # It lies on top: of what is closed or full of shelves, or across a loose thing and so where that lies.
        parent = world.objects[other.parent] if other.type.pickupable and other.parent is not None else None
        yield _Ground(float(other.bounds()[1][1]), parent)


def _cut_out(other: SimObject, basins: list[SimObject]) -> bool:
    """Whether a piece of furniture has one of some basins let into its surface."""
    if other.type.pickupable or other.type.open_top:
        return False
    low, high = other.bounds()
    return any(np.all(basin.center > low - _SUNK) and np.all(basin.center < high + _SUNK) for basin in basins)


def _under(surface: Surface, point: Array) -> bool:
    local = np.abs(yaw_matrix(surface.yaw).T @ (point - surface.center))
    return bool(local[0] <= surface.half[0] and local[2] <= surface.half[1])


def _fits(item: SimObject, vessel: SimObject, surface: Surface) -> bool:
    """Whether an object goes into a hollow thing; onto others it goes anyway."""
    if not vessel.type.open_top:
        return True
    low, high = item.bounds()
    return bool(min(high[0] - low[0], high[2] - low[2]) <= 2 * max(surface.half))


def _open_above(other: SimObject, surface: Surface, bottom: float) -> bool:
    """Whether nothing of the receptacle is between its surface and an object whose underside is at `bottom`.

    A drawer is open above where it has come out.
    """
    return other.type.slides or bottom <= float(surface.center[1]) + surface.headroom


def _over(other: SimObject, point: Array) -> bool:
    low, high = other.bounds()
    return bool(low[0] <= point[0] <= high[0] and low[2] <= point[2] <= high[2])
