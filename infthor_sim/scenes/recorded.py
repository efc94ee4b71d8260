"""Building objects from AI2-THOR's own metadata."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from infthor_sim.errors import DataError
from infthor_sim.geometry import Array, to_array, wrap_degrees, yaw_matrix
from infthor_sim.object_types import ObjectType, type_named
from infthor_sim.objects import SimObject, SimObjectState, style_of

# degrees of pitch or roll beyond which an object's yaw is taken from its box, not from its angles
_TILTED = 10.0


def recorded_object(entry: Mapping[str, Any]) -> SimObject:
    """Return an upright object from an entry of `metadata["objects"]`; its box takes a small tilt.

    Raises:
        DataError: a required field is missing or malformed.
    """
    try:
        return _object(entry)
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
        name = entry.get("objectId", "?") if isinstance(entry, Mapping) else "?"
        raise DataError(
            f"object {name}: not in the form of AI2-THOR's metadata ({error!r})"
        ) from error


def _object(entry: Mapping[str, Any]) -> SimObject:
    position = to_array(entry["position"])
    declared = _type(entry)
    oriented = entry.get("objectOrientedBoundingBox")
    if oriented and oriented.get("cornerPoints"):
        points = np.array(oriented["cornerPoints"], dtype=float)
        yaw = _yaw(entry["rotation"], points)
    else:  # the world's axes are the best guess for an object that is not turned by a quarter
        box = entry["axisAlignedBoundingBox"]
        center = to_array(box["center"])
        half = to_array(box["size"]) / 2
        points = np.array([center - half, center + half])
        yaw = round(float(entry["rotation"]["y"]) / 90) * 90.0
    local = (points - position) @ yaw_matrix(yaw)
    low, high = local.min(axis=0), local.max(axis=0)
    object_id = str(entry["objectId"])
    return SimObject(
        object_id=object_id,
        name=str(entry["name"]),
        type=declared,
        position=position,
        rotation=np.array([0.0, yaw % 360.0, 0.0]),
        box_center=(low + high) / 2,
        box_size=np.maximum(high - low, 1e-3),
        asset_id=str(entry.get("assetId") or ""),
        support=declared.support_height(float(high[1] - low[1])),
        style=style_of(str(entry.get("assetId") or object_id)),
        state=_state(entry),
    )


def _type(entry: Mapping[str, Any]) -> ObjectType:
    """Return the record of the entry's type with the entry's abilities: versions differ."""
    declared = type_named(str(entry["objectType"]))
    return replace(
        declared,
        pickupable=bool(entry["pickupable"]),
        moveable=bool(entry["moveable"]),
        receptacle=bool(entry["receptacle"]) or declared.receptacle,
        openable=bool(entry["openable"]),
        toggleable=bool(entry["toggleable"]),
        breakable=bool(entry["breakable"]),
        fillable=bool(entry["canFillWithLiquid"]),
        dirtyable=bool(entry["dirtyable"]),
        usable_up=bool(entry["canBeUsedUp"]),
        cookable=bool(entry["cookable"]),
        sliceable=bool(entry["sliceable"]),
        mass=float(entry.get("mass") or 0.0),
        materials=tuple(entry.get("salientMaterials") or declared.materials),
    )


def _state(entry: Mapping[str, Any]) -> SimObjectState:
    openness = float(entry.get("openness") or 0.0)
    return SimObjectState(
        openness=openness or (1.0 if entry.get("isOpen") else 0.0),
        toggled=bool(entry.get("isToggled")),
        broken=bool(entry.get("isBroken")),
        fill_liquid=entry.get("fillLiquid")
        or ("water" if entry.get("isFilledWithLiquid") else None),
        dirty=bool(entry.get("isDirty")),
        used_up=bool(entry.get("isUsedUp")),
        cooked=bool(entry.get("isCooked")),
        temperature=str(entry.get("temperature") or "RoomTemp").removeprefix("Temperature."),
    )


def _yaw(rotation: Mapping[str, float], points: Array) -> float:
    """Return the yaw in degrees; for an object on its side, of its longest level edge."""
    tilt = max(abs(wrap_degrees(float(rotation["x"]))), abs(wrap_degrees(float(rotation["z"]))))
    if tilt <= _TILTED:
        return float(rotation["y"])
    # Three edges that meet at a corner, by AI2-THOR's order of corners.
    edges = [points[1] - points[0], points[3] - points[0], points[4] - points[0]]
    level = [
        edge for edge in edges if abs(edge[1]) < 0.5 * float(np.linalg.norm(edge)) + 1e-9
    ] or edges
    longest = max(level, key=lambda edge: float(np.linalg.norm(edge)))
    return math.degrees(math.atan2(longest[0], longest[2]))
