"""Giving recorded objects the ids that trajectories use.

Trajectories were recorded with another version of AI2-THOR than the objects' metadata: fixed things may have another
id, another type of table, or be missing. What a trajectory interacts with must exist under the id it uses.
"""

from collections.abc import Iterable

import numpy as np

from infthor_eval.sim.default_objects import default_object
from infthor_eval.sim.geometry import Array
from infthor_eval.sim.navigation import NavGrid
from infthor_eval.sim.object_types import type_named
from infthor_eval.sim.objects import SimObject

__all__ = ["adopt"]

_NEAR = 0.3


def adopt(objects: dict[str, SimObject], wanted: Iterable[str], nav: NavGrid, floor: float) -> dict[str, SimObject]:
    """`objects` with every fixed thing of the ids `wanted`: renamed, retyped or added where it is missing.

    Ids of loose objects are left alone: those come with a trajectory's own poses.
    """
    missing = [i for i in sorted(set(wanted)) if i not in objects and not _loose(i)]
    pairs = sorted(
        (cost, found, item.object_id) for found in missing for item in objects.values()
        if (cost := _cost(found, item)) is not None
    )  # fmt: skip
    taken: set[str] = set(wanted) & set(objects)
    renamed: dict[str, str] = {}
    for _, found, old in pairs:
        if found not in renamed.values() and old not in taken:
            renamed[old] = found
            taken.add(old)
    result = {}
    for item in objects.values():
        if item.object_id in renamed:
            _rename(item, renamed[item.object_id])
        result[item.object_id] = item
    for found in missing:
        if found not in result:
            result[found] = _added(found, nav, floor)
    return result


def parse_id(object_id: str) -> tuple[str, Array]:
    """Type and position of an id; `Sink|..|..|..|SinkBasin` is a SinkBasin."""
    parts = object_id.split("|")
    object_type = parts[4].split("_")[0] if len(parts) > 4 else parts[0]
    try:
        return object_type, np.array([float(p) for p in parts[1:4]])
    except ValueError:
        return object_type, np.full(3, np.nan)


def _loose(object_id: str) -> bool:
    object_type, position = parse_id(object_id)
    return type_named(object_type).pickupable or len(position) != 3 or bool(np.isnan(position).any())


def _cost(wanted: str, item: SimObject) -> float | None:
    """How unlike the wanted thing is; None: it cannot be it."""
    object_type, position = parse_id(wanted)
    low, high = item.bounds()
    level = float(np.hypot(*(position - item.position)[[0, 2]]))
    rise = abs(float(position[1] - item.position[1]))
    if object_type == item.object_type:
        away = float(np.hypot(level, rise)) if item.type.stacked else level + 0.05 * rise
        inside = item.type.furniture and bool(np.all((position >= low - 0.05) & (position <= high + 0.3)))
        return away if away <= _NEAR or inside else None
    if type_named(object_type).furniture and item.type.furniture and level <= _NEAR:
        return 1.0 + level
    return None


def _rename(item: SimObject, wanted: str) -> None:
    object_type, position = parse_id(wanted)
    offset = position - item.position
    if float(np.hypot(offset[0], offset[2])) <= _NEAR:
        rise = offset[1] if item.type.stacked else 0.0
        item.position = item.position + np.array([offset[0], rise, offset[2]])
    if object_type != item.object_type:
        item.type = type_named(object_type)
        item.support = item.type.support_height(float(item.box_size[1]))
    item.object_id = wanted


def _added(wanted: str, nav: NavGrid, floor: float) -> SimObject:
    object_type, position = parse_id(wanted)
    item = default_object(object_type, position, nav.freest_yaw(position[0], position[2]))
    if item.type.furniture:
        top = position[1] if position[1] - floor > 0.3 else floor + item.type.size[1]
        item.box_size = np.array([item.box_size[0], top - floor, item.box_size[2]])
        item.box_center = np.array([0.0, (top + floor) / 2 - position[1], 0.0])
        item.support = item.type.support_height(float(item.box_size[1]))
    item.object_id = wanted
    return item
