"""Building worlds from recorded floor plans.

Objects are built from AI2-THOR's own metadata, and get the ids that trajectories use. Cells of the
agent that a recording leaves out, because an open door or drawer would be there, are added.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from infthor_sim.agent import AGENT_HEIGHT, Agent
from infthor_sim.errors import DataError
from infthor_sim.geometry import Array, level_gaps, to_array, wrap_degrees, yaw_matrix
from infthor_sim.object_types import ObjectType, type_named
from infthor_sim.objects import SimObject, SimObjectState, default_object, style_of
from infthor_sim.physics.navigation import CELL, NavGrid
from infthor_sim.physics.obstacles import door_leaf
from infthor_sim.rearrange import assign_parents
from infthor_sim.scenes.layout_inference import infer_layout
from infthor_sim.scenes.supplement import Supplement
from infthor_sim.world import FLOOR_STYLES, RoomShell, World

_CEILING = 2.6  # metres
# Poses (x, z, yaw) that AI2-THOR starts its agent in, where known: recordings do not have them.
# Others are inferred.
_STARTS = {"FloorPlan28": (-1.5, -1.5, 180.0)}
# of floors, by the hundreds of the floor plan
_STYLES = {0: "tiles", 2: "wood", 3: "carpet", 4: "tiles"}
_RADIUS = 0.2  # of the agent's capsule, metres
_OPENNESS = (0.25, 0.5, 0.75, 1.0)
_KNEE = 0.1  # metres above the floor below which nothing stops the agent
# degrees of pitch or roll beyond which an object's yaw is taken from its box, not from its angles
_TILTED = 10.0
_NEAR = 0.3  # metres that an object may be off between the two versions


def build_floor_plan(
    name: str, entries: Sequence[Mapping[str, Any]], layout: Array | None, extra: Supplement
) -> World:
    """Return the world of a recorded floor plan.

    Args:
        name: name of the scene, e.g. `FloorPlan10`.
        entries: `metadata["objects"]` of the floor plan.
        layout: reachable (x, z), metres (n, 2); None if unknown.
        extra: additions from trajectories.
    """
    cells = [] if layout is None else [(float(x), float(z)) for x, z in layout]
    cells += extra.cells
    if not cells:
        raise DataError(
            f"{name}: no alfred/layouts/{name}-layout.npy and no visited cells: nowhere to stand"
        )
    nav = NavGrid(cells)
    objects = {item.object_id: item for item in map(_recorded_object, entries)}
    floor = max(
        (float(o.bounds()[1][1]) for o in objects.values() if o.object_type == "Floor"), default=0.0
    )
    objects = _use_trajectory_ids(objects, extra.objects, nav, floor)
    room = _room(name, list(objects.values()), cells, floor)
    height = floor + AGENT_HEIGHT if extra.floor_y is None else extra.floor_y
    agent = _agent_at_start(name, nav, room, height)
    world = World(name, objects, (room,), nav, [agent], seed=_number(name), coarse=True)
    world.open_at_start = frozenset(o.object_id for o in objects.values() if o.state.openness > 0)
    _assign_recorded_parents(world, entries)
    infer_layout(world)
    for item in objects.values():
        if item.object_type == "Floor":
            item.style = FLOOR_STYLES.index(room.floor_style)
    assign_parents(world)
    _add_door_cells(world)
    world.keep_templates()
    return world


def _agent_at_start(name: str, nav: NavGrid, room: RoomShell, height: float) -> Agent:
    """Return the agent as AI2-THOR starts it, or in the room's middle towards the most floor."""
    middle = nav.nearest((room.x_min + room.x_max) / 2, (room.z_min + room.z_max) / 2)
    x, z, yaw = _STARTS.get(name, (*middle, nav.freest_yaw(*middle, reach=3.0)))
    return Agent(np.array([x, height, z]), yaw)


def _assign_recorded_parents(world: World, entries: Sequence[Mapping[str, Any]]) -> None:
    """Attach loose objects to the innermost receptacle that the recording names, the smallest.

    The floor is the outermost, however small.
    """
    for entry in entries:
        item = world.objects.get(str(entry["objectId"]))
        if item is None or not item.type.pickupable:
            continue
        parents = [
            world.objects[p] for p in entry.get("parentReceptacles") or () if p in world.objects
        ]
        holding = [p for p in parents if p.type.receptacle and p is not item]
        if holding:
            world.attach(item, min(holding, key=_size))


def _size(receptacle: SimObject) -> tuple[bool, float, str]:
    volume = float(np.prod(receptacle.box_size))
    return receptacle.object_type == "Floor", volume, receptacle.object_id


def _room(
    name: str, objects: list[SimObject], cells: list[tuple[float, float]], floor: float
) -> RoomShell:
    """Return a rectangular room around all its objects and cells: recordings have no walls."""
    lows = [np.array([x - 0.25, floor, z - 0.25]) for x, z in cells]
    highs = [np.array([x + 0.25, floor, z + 0.25]) for x, z in cells]
    for item in objects:
        if not item.type.beyond_room:
            low, high = item.bounds()
            lows.append(low)
            highs.append(high)
    low, high = np.min(lows, axis=0), np.max(highs, axis=0)
    number = _number(name)
    return RoomShell(
        float(low[0]), float(high[0]), float(low[2]), float(high[2]),
        max(floor + _CEILING, float(high[1]) + 0.05),
        floor, _STYLES.get(number // 100, "wood"), number,
    )  # fmt: skip


def _number(name: str) -> int:
    """Return the number in a scene's name, 0 without one: the seed of the scene, and its style."""
    digits = "".join(letter for letter in name if letter.isdigit())
    return int(digits[:9]) if digits else 0


def _add_door_cells(world: World) -> None:
    """Add the cells beside the grid that only a door or drawer, closed now, could block.

    ALFRED's layouts have no such cells, but AI2-THOR lets its agent stand there while the door is
    closed. An open door blocks them as it blocks others, see `obstacles`.
    """
    points = np.array(sorted(set(_fringe(world.nav)))).reshape(-1, 2)
    clear = ClearFloor(world)
    free = points[_in_reach_of_a_door(world, points) & clear.at(points)]
    world.nav = NavGrid([*world.nav, *((float(x), float(z)) for x, z in free)], clear)


def _fringe(nav: NavGrid) -> Iterator[tuple[float, float]]:
    """Yield the points one or two steps off the grid, with repetitions."""
    for x, z in nav:
        for i in (-2, -1, 0, 1, 2):
            for j in (-2, -1, 0, 1, 2):
                point = (round(x + i * CELL, 4), round(z + j * CELL, 4))
                if abs(i) + abs(j) in (1, 2) and not nav.can_stand(*point):
                    yield point


def _in_reach_of_a_door(world: World, points: Array) -> NDArray[np.bool_]:
    """Return at which points (n, 2) the agent would touch a door or drawer that opens wide."""
    reached = np.zeros(len(points), dtype=bool)
    for item in world.objects.values():
        if item.state.openness == 0 and (item.type.hinged or item.type.slides):
            for leaf in _leaves(item):
                reached |= level_gaps(points, *leaf) < _RADIUS
    return reached


def _leaves(item: SimObject) -> Iterator[tuple[Array, Array]]:
    """Yield the corners of boxes around an object's door or drawer as it opens wide."""
    opened = item.duplicate(item.object_id)
    for opened.state.openness in _OPENNESS:
        leaf = door_leaf(opened)
        if leaf is not None:
            yield leaf


class ClearFloor:
    """Where the agent's capsule touches neither the walls of a room nor an object, by their boxes.

    Args:
        world: the room, as recorded; what moves in it later moves no floor.
    """

    def __init__(self, world: World) -> None:
        self._room = np.array(world.scene_bounds())[:, [0, 2]]
        floor = world.standing_height - AGENT_HEIGHT
        boxes = [o.bounds() for o in world.objects.values() if o.object_type != "Floor"]
        self._boxes = [
            box
            for box in boxes
            if box[1][1] > floor + _KNEE and box[0][1] < floor + 2 * AGENT_HEIGHT
        ]

    def at(self, points: Array) -> NDArray[np.bool_]:
        """Return at which points (n, 2) the floor is clear."""
        low, high = self._room
        clear = np.minimum(points - low, high - points).min(axis=1, initial=np.inf) >= _RADIUS
        for box in self._boxes:
            clear &= level_gaps(points, *box) >= _RADIUS
        return np.asarray(clear)

    def __call__(self, x: float, z: float) -> bool:
        """Return whether the floor is clear at (x, z)."""
        return bool(self.at(np.array([[x, z]]))[0])


def _recorded_object(entry: Mapping[str, Any]) -> SimObject:
    """Return an upright object from an entry of `metadata["objects"]`; its box takes a small
    tilt."""
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


def _use_trajectory_ids(
    objects: dict[str, SimObject], ids: Iterable[str], nav: NavGrid, floor: float
) -> dict[str, SimObject]:
    """Return `objects` with a fixed one for each id: renamed, of another type, or created.

    Trajectories were recorded with another version of AI2-THOR than the objects' metadata: fixed
    objects may have another id, be another type of table, or be missing. What a trajectory
    interacts with must exist under the trajectory's id.

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


def _parse_id(object_id: str) -> tuple[str, Array]:
    """Return type and position (3,) of an id; `Sink|..|..|..|SinkBasin` is a SinkBasin."""
    parts = object_id.split("|")
    object_type = parts[4].split("_")[0] if len(parts) > 4 else parts[0]
    try:
        return object_type, np.array([float(p) for p in parts[1:4]])
    except ValueError:
        return object_type, np.full(3, np.nan)


def _is_loose(object_id: str) -> bool:
    object_type, position = _parse_id(object_id)
    return (
        type_named(object_type).pickupable or len(position) != 3 or bool(np.isnan(position).any())
    )


def _match_cost(object_id: str, item: SimObject) -> float | None:
    """Return how unlikely it is that an id names an object; None: it names another one."""
    object_type, position = _parse_id(object_id)
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
    object_type, position = _parse_id(object_id)
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
    object_type, position = _parse_id(object_id)
    item = default_object(object_type, position, nav.freest_yaw(position[0], position[2]))
    # the id's height is that of its top, or of its underside if near the floor
    if item.type.furniture:
        top = position[1] if position[1] - floor > 0.3 else floor + item.type.size[1]
        item.box_size = np.array([item.box_size[0], top - floor, item.box_size[2]])
        item.box_center = np.array([0.0, (top + floor) / 2 - position[1], 0.0])
        item.support = item.type.support_height(float(item.box_size[1]))
    item.object_id = object_id
    return item
