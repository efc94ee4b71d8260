"""Giving recorded objects the ids that trajectories use.

Trajectories were recorded with another version of AI2-THOR than the objects' metadata: fixed
objects may have another id, be another type of table, or be missing. What a trajectory interacts
with must exist under the trajectory's id.
"""

from collections.abc import Iterable

import numpy as np

from infthor_sim.geometry import Array
from infthor_sim.object_types import type_named
from infthor_sim.objects import SimObject, default_object
from infthor_sim.physics.navigation import NavGrid

_NEAR = 0.3  # metres that an object may be off between the two versions


def use_trajectory_ids(
    objects: dict[str, SimObject], ids: Iterable[str], nav: NavGrid, floor: float
) -> dict[str, SimObject]:
    """Return `objects` with a fixed one for each id: renamed, of another type, or created.

    Ids of loose objects are skipped: those come with a trajectory's own poses.
    """
    missing = [i for i in sorted(set(ids)) if i not in objects and not _is_loose(i)]
    # All pairs, cheapest first, so that the best matches are made before an object is taken by a
    # worse one.
    pairs = sorted(
        (cost, new_id, item.object_id) for new_id in missing for item in objects.values()
        if (cost := _match_cost(new_id, item)) is not None
    )  # fmt: skip
    taken: set[str] = set(ids) & set(objects)
    renamed: dict[str, str] = {}
    for _, new_id, old_id in pairs:
        if new_id not in renamed.values() and old_id not in taken:
            renamed[old_id] = new_id
            taken.add(old_id)
    result = {}
    for item in objects.values():
        if item.object_id in renamed:
            _rename(item, renamed[item.object_id])
        result[item.object_id] = item
    for new_id in missing:
        if new_id not in result:
            result[new_id] = _create(new_id, nav, floor)
    return result


def parse_id(object_id: str) -> tuple[str, Array]:
    """Return type and position (3,) of an id; `Sink|..|..|..|SinkBasin` is a SinkBasin."""
    parts = object_id.split("|")
    object_type = parts[4].split("_")[0] if len(parts) > 4 else parts[0]
    try:
        return object_type, np.array([float(p) for p in parts[1:4]])
    except ValueError:
        return object_type, np.full(3, np.nan)


def _is_loose(object_id: str) -> bool:
    object_type, position = parse_id(object_id)
    return (
        type_named(object_type).pickupable or len(position) != 3 or bool(np.isnan(position).any())
    )


def _match_cost(object_id: str, item: SimObject) -> float | None:
    """Return how unlikely it is that an id names an object; None: it names another one."""
    object_type, position = parse_id(object_id)
    low, high = item.bounds()
    level = float(np.hypot(*(position - item.position)[[0, 2]]))
    rise = abs(float(position[1] - item.position[1]))
    if object_type == item.object_type:
        # Versions differ in the height of origins, so it counts little, but for drawers and the
        # like above each other.
        away = float(np.hypot(level, rise)) if item.type.stacked else level + 0.05 * rise
        inside = item.type.furniture and bool(
            np.all((position >= low - 0.05) & (position <= high + 0.3))
        )
        return away if away <= _NEAR or inside else None
    if type_named(object_type).furniture and item.type.furniture and level <= _NEAR:
        return 1.0 + level
    return None


def _rename(item: SimObject, object_id: str) -> None:
    object_type, position = parse_id(object_id)
    offset = position - item.position
    if float(np.hypot(offset[0], offset[2])) <= _NEAR:
        rise = offset[1] if item.type.stacked else 0.0  # other objects stay on the floor or counter
        item.position = item.position + np.array([offset[0], rise, offset[2]])
    if object_type != item.object_type:
        item.type = type_named(object_type)
        item.support = item.type.support_height(float(item.box_size[1]))
    item.object_id = object_id


def _create(object_id: str, nav: NavGrid, floor: float) -> SimObject:
    """Return a new object of an id's type and position, turned to the free floor."""
    object_type, position = parse_id(object_id)
    item = default_object(object_type, position, nav.freest_yaw(position[0], position[2]))
    # the id's height is that of its top, or of its underside if near the floor
    if item.type.furniture:
        top = position[1] if position[1] - floor > 0.3 else floor + item.type.size[1]
        item.box_size = np.array([item.box_size[0], top - floor, item.box_size[2]])
        item.box_center = np.array([0.0, (top + floor) / 2 - position[1], 0.0])
        item.support = item.type.support_height(float(item.box_size[1]))
    item.object_id = object_id
    return item
