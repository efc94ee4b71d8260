"""Building worlds from ProcTHOR's house JSON, as `CreateHouse` takes it."""

import gzip
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from infthor_sim.agent import AGENT_HEIGHT, Agent
from infthor_sim.errors import DataError
from infthor_sim.geometry import Array, level_gaps, segment_gaps, to_array
from infthor_sim.object_types import type_named
from infthor_sim.objects import SimObject, SimObjectState, style_of
from infthor_sim.physics.doorways import BODY, update_floor
from infthor_sim.physics.footprints import Rect, polygon_rects
from infthor_sim.physics.navigation import CELL, NavGrid
from infthor_sim.rearrange import assign_parents
from infthor_sim.scenes.layout_inference import infer_layout
from infthor_sim.world import FLOOR_STYLES, RoomShell, Wall, World

# All lengths in metres.
_HEIGHT = 2.6  # of ceilings
_FARTHEST = 200.0  # of a floor from the origin, metres: beyond it cells take minutes to count
_DOOR_TOP = 2.05
_FLOORS = {"Kitchen": "tiles", "Bathroom": "tiles", "Bedroom": "carpet", "LivingRoom": "wood"}
# What reading a document of another form raises.
_MALFORMED = (LookupError, TypeError, ValueError, OverflowError, AttributeError)
_ASSETS = Path("procthor/asset-database.json.gz")
Span = tuple[float, float, float, float]
Sizes = Mapping[str, tuple[float, float, float]]


def read_asset_sizes(root: Path) -> dict[str, tuple[float, float, float]]:
    """Return the sizes (width, height, depth) of ProcTHOR's assets by id; empty without the
    file."""
    path = root / _ASSETS
    if not path.exists():
        return {}
    try:
        with gzip.open(path, "rt", encoding="utf-8") as file:
            content = json.load(file)
        listed = [asset for assets in content.values() for asset in assets]
        return {str(asset["assetId"]): _extents(asset["boundingBox"]) for asset in listed}
    except (OSError, EOFError, *_MALFORMED) as error:
        raise DataError(f"{path}: not a readable asset database ({error!r})") from error


def _extents(box: Mapping[str, float]) -> tuple[float, float, float]:
    return max(float(box["x"]), 0.002), max(float(box["y"]), 0.002), max(float(box["z"]), 0.002)


def build_house(house: Mapping[str, Any], assets: Sizes) -> World:
    """Return the world of a house.

    Args:
        house: ProcTHOR's JSON: `rooms`, `walls`, `doors`, `windows`, `objects`, `metadata`.
        assets: sizes of assets by id; others get their type's usual size.
    """
    try:
        return _build(house, assets)
    except _MALFORMED as error:
        raise DataError(f"house: not in ProcTHOR's form ({error!r})") from error


def _build(house: Mapping[str, Any], assets: Sizes) -> World:
    floors = []
    for room in house["rooms"]:
        outline = [(_metres(point["x"]), _metres(point["z"])) for point in room["floorPolygon"]]
        floors.append((str(room.get("roomType", "")), polygon_rects(outline)))
    ids = [_text(r.get("id", f"room|{index}")) for index, r in enumerate(house["rooms"])]
    doors = list(_door_spans(house))
    walls = tuple(_walls(house, doors))
    objects: dict[str, SimObject] = {}
    for room_id, (room_type, rects) in zip(ids, floors, strict=True):
        floor = _floor(room_id, room_type, rects)
        objects[floor.object_id] = floor
    for entry in _with_children(house.get("objects", ())):
        item = _object(entry, assets)
        objects[item.object_id] = item
    for entry in house.get("doors", ()):
        objects[_text(entry["id"])] = _door(entry, house, assets)
    for entry in house.get("windows", ()):
        if "assetPosition" in entry:
            objects[_text(entry["id"])] = _window(entry, house)
    rooms = tuple(
        RoomShell(*(r[0], r[2], r[1], r[3]), _HEIGHT, 0.0, _FLOORS.get(room_type, "wood"), index,
                  walled=False)
        for index, (room_type, rects) in enumerate(floors) for r in rects
    )  # fmt: skip
    nav = _nav([r for _, rects in floors for r in rects], walls, list(objects.values()))
    agent = _agent(house, nav)
    world = World("Procedural", objects, rooms, nav, [agent], walls=walls, floor=nav)
    update_floor(world)
    world.keeps_ids = True
    infer_layout(world)
    assign_parents(world)
    world.keep_templates()
    return world


def _metres(value: Any) -> float:
    """Return a coordinate of a floor, whose cells are counted one by one."""
    metres = float(value)
    if not abs(metres) <= _FARTHEST:
        raise DataError(f"house: a floor reaches to {metres:g} m; use at most {_FARTHEST:g} m")
    return metres


def _text(value: Any) -> str:
    """Return a text that a message can carry, which has no half of a pair of code units."""
    text = str(value)
    text.encode()
    return text


def _with_children(entries: Sequence[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
    for entry in entries:
        yield entry
        yield from _with_children(entry.get("children", ()))


def _object(entry: Mapping[str, Any], assets: Sizes) -> SimObject:
    """Return an object; ProcTHOR's position is the middle of the asset's box."""
    object_id = _text(entry["id"])
    declared = type_named(_text(entry.get("objectType") or object_id.split("|", 1)[0]))
    asset = _text(entry.get("assetId", ""))
    size = np.array(assets.get(asset) or declared.size)
    rotation = to_array(entry.get("rotation") or {})
    return SimObject(
        object_id=object_id,
        name=object_id,
        type=declared,
        position=to_array(entry["position"]),
        rotation=np.array([0.0, rotation[1] % 360, 0.0]),
        box_center=np.zeros(3),
        box_size=size,
        asset_id=asset,
        support=declared.support_height(float(size[1])),
        style=style_of(asset or object_id),
        state=SimObjectState(openness=1.0 if declared.starts_open else 0.0),
    )


def _floor(room_id: str, room_type: str, rects: Sequence[Rect]) -> SimObject:
    """Return a room's floor, an object as in AI2-THOR, under the room's id."""
    low = np.array([min(r[0] for r in rects), -0.1, min(r[1] for r in rects)])
    high = np.array([max(r[2] for r in rects), 0.0, max(r[3] for r in rects)])
    middle = (low + high) / 2
    item = SimObject(
        room_id,
        f"Floor_{room_id}",
        type_named("Floor"),
        middle,
        np.zeros(3),
        np.zeros(3),
        high - low,
        style=0,
    )
    item.style = FLOOR_STYLES.index(_FLOORS.get(room_type, "wood"))
    item.pieces = tuple(
        (r[0] - middle[0], r[1] - middle[2], r[2] - middle[0], r[3] - middle[2]) for r in rects
    )
    return item


def _door(
    entry: Mapping[str, Any],
    house: Mapping[str, Any],
    assets: Sizes,
) -> SimObject:
    """Return a doorway's door or frame; it opens to the left of its first wall's direction."""
    wall = next(w for w in house["walls"] if w["id"] == (entry.get("wall0") or entry.get("wall1")))
    x0, z0, x1, z1 = _base(wall["polygon"])
    asset = _text(entry.get("assetId", ""))
    low, high = (to_array(corner) for corner in _hole(entry))
    declared = type_named("Doorframe" if asset.startswith("Doorframe") else "Doorway")
    size = np.array(assets.get(asset) or (*np.abs(high - low)[:2], declared.size[2]))
    at = to_array(entry["assetPosition"]) if "assetPosition" in entry else (low + high) / 2
    share = float(at[0]) / max(math.dist((x0, z0), (x1, z1)), 1e-6)
    object_id = _text(entry["id"])
    return SimObject(
        object_id, object_id,
        replace(declared, openable=declared.openable and bool(entry.get("openable", True))),
        np.array([x0 + (x1 - x0) * share, at[1], z0 + (z1 - z0) * share]),
        np.array([0.0, math.degrees(math.atan2(z0 - z1, x1 - x0)) % 360, 0.0]), np.zeros(3),
        np.maximum(size, 0.01), asset_id=asset, style=style_of(asset or object_id),
        state=SimObjectState(openness=float(entry.get("openness") or 0.0)),
    )  # fmt: skip


def _hole(entry: Mapping[str, Any]) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Return two opposite corners of a doorway: from its wall's start, and upwards."""
    if "holePolygon" in entry:
        return entry["holePolygon"][0], entry["holePolygon"][1]
    return entry["boundingBox"]["min"], entry["boundingBox"]["max"]


def _window(entry: Mapping[str, Any], house: Mapping[str, Any]) -> SimObject:
    """Return a window; ProcTHOR gives its position along its wall and its height."""
    wall = next(w for w in house["walls"] if w["id"] == entry["wall0"])
    x0, z0, x1, z1 = _base(wall["polygon"])
    length = math.dist((x0, z0), (x1, z1))
    local = to_array(entry["assetPosition"])
    share = float(local[0]) / max(length, 1e-6)
    object_id = _text(entry["id"])
    position = np.array([x0 + (x1 - x0) * share, local[1], z0 + (z1 - z0) * share])
    return SimObject(
        object_id, object_id, type_named("Window"), position,
        np.array([0.0, math.degrees(math.atan2(x1 - x0, z1 - z0)) + 90.0, 0.0]), np.zeros(3),
        np.array([1.0, 1.2, 0.16]), asset_id=_text(entry.get("assetId", "")),
    )  # fmt: skip


def _base(polygon: Sequence[Mapping[str, float]]) -> Span:
    """Return a wall's lower corners in the order of its polygon; distances count from the first."""
    by_height = sorted(range(len(polygon)), key=lambda index: float(polygon[index]["y"]))
    first, second = sorted(by_height[:2])
    start, end = polygon[first], polygon[second]
    return float(start["x"]), float(start["z"]), float(end["x"]), float(end["z"])


def _door_spans(house: Mapping[str, Any]) -> Iterator[tuple[str, float, float]]:
    """Yield a doorway once per wall that it is in: the wall's id, and from and to along it."""
    for door in house.get("doors", ()):
        points = [float(corner["x"]) for corner in _hole(door)]
        for key in ("wall0", "wall1"):
            if door.get(key):
                yield str(door[key]), min(points), max(points)


def _walls(house: Mapping[str, Any], doors: Sequence[tuple[str, float, float]]) -> Iterator[Wall]:
    for wall in house["walls"]:
        x0, z0, x1, z1 = _base(wall["polygon"])
        length = math.dist((x0, z0), (x1, z1))
        if length < 1e-6 or wall.get("empty") or "exterior" in str(wall["id"]):
            # exterior walls coincide with those of rooms; empty ones are openings between rooms
            continue
        style = style_of(str(wall.get("roomId", "")))
        at = 0.0
        for _, low, high in sorted(d for d in doors if d[0] == str(wall["id"])):
            yield _stretch((x0, z0, x1, z1), length, at, low, 0.0, style)
            yield _stretch((x0, z0, x1, z1), length, low, high, _DOOR_TOP, style)
            at = high
        yield _stretch((x0, z0, x1, z1), length, at, length, 0.0, style)


def _stretch(ends: Span, length: float, low: float, high: float, bottom: float, style: int) -> Wall:
    """Return a wall's part between two distances along it, from `bottom` to the ceiling."""
    x0, z0, x1, z1 = ends
    a = low / length
    b = high / length
    return Wall(
        x0 + (x1 - x0) * a,
        z0 + (z1 - z0) * a,
        x0 + (x1 - x0) * b,
        z0 + (z1 - z0) * b,
        bottom,
        _HEIGHT,
        style,
    )


def _nav(rects: Sequence[Rect], walls: Sequence[Wall], objects: list[SimObject]) -> NavGrid:
    """Return the cells of the rooms that are clear of walls and furniture."""
    cells = {
        (round(x * CELL, 4), round(z * CELL, 4)) for r in rects
        for x in range(math.ceil(r[0] / CELL), math.floor(r[2] / CELL) + 1)
        for z in range(math.ceil(r[1] / CELL), math.floor(r[3] / CELL) + 1)
    }  # fmt: skip
    points: Array = np.array(sorted(cells)).reshape(-1, 2)
    for wall in walls:
        if wall.bottom < 1.0:  # not the part above a doorway
            ends = np.array([[wall.x0, wall.z0], [wall.x1, wall.z1]])
            points = points[segment_gaps(points, *ends) >= BODY]
    for item in objects:
        low, high = item.bounds()
        if (
            item.object_type != "Floor"
            and not (item.type.pickupable or item.type.in_doorway)
            and low[1] < 1.6
            and high[1] > 0.1
        ):
            points = points[level_gaps(points, low, high) >= BODY]
    if not len(points):
        raise DataError("house: its rooms leave nowhere to stand")
    return NavGrid([(float(x), float(z)) for x, z in points])


def _agent(house: Mapping[str, Any], nav: NavGrid) -> Agent:
    start = (house.get("metadata") or {}).get("agent") or {}
    if "position" in start:
        x, z = nav.nearest(float(start["position"]["x"]), float(start["position"]["z"]))
    else:  # in the largest connected part, as far as some twenty samples tell
        x, z = max(
            (nav.reachable_cells(*cell) for cell in list(nav)[:: max(1, len(nav) // 20)]), key=len
        )[0]
    turn = start.get("rotation", 0.0)
    yaw = float(turn.get("y", 0.0) if isinstance(turn, Mapping) else turn)
    return Agent(np.array([x, AGENT_HEIGHT, z]), yaw % 360, float(start.get("horizon", 0.0)))
