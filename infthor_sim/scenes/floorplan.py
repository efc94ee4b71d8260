"""Building worlds from recorded floor plans."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from infthor_sim.agent import AGENT_HEIGHT, Agent
from infthor_sim.errors import DataError
from infthor_sim.geometry import Array
from infthor_sim.objects import SimObject
from infthor_sim.physics.navigation import NavGrid
from infthor_sim.rearrange import assign_parents
from infthor_sim.scenes.door_cells import add_door_cells
from infthor_sim.scenes.layout_inference import infer_layout
from infthor_sim.scenes.recorded import recorded_object
from infthor_sim.scenes.supplement import Supplement
from infthor_sim.scenes.trajectory_ids import use_trajectory_ids
from infthor_sim.world import FLOOR_STYLES, RoomShell, World

_CEILING = 2.6  # metres
# Poses (x, z, yaw) that AI2-THOR starts its agent in, where known: recordings do not have them.
# Others are inferred.
_STARTS = {"FloorPlan28": (-1.5, -1.5, 180.0)}
# of floors, by the hundreds of the floor plan
_STYLES = {0: "tiles", 2: "wood", 3: "carpet", 4: "tiles"}


def build_floor_plan(
    name: str, entries: Sequence[Mapping[str, Any]], layout: Array | None, extra: Supplement
) -> World:
    """Return the world of a recorded floor plan.

    Args:
        name: name of the scene, e.g. `FloorPlan10`.
        entries: `metadata["objects"]` of the floor plan.
        layout: reachable (x, z), metres (n, 2); None if unknown.
        extra: additions from trajectories.

    Raises:
        DataError: neither a layout nor trajectories give a cell to stand on, or an entry is
            malformed.
    """
    cells = [] if layout is None else [(float(x), float(z)) for x, z in layout]
    cells += extra.cells
    if not cells:
        raise DataError(
            f"{name}: no alfred/layouts/{name}-layout.npy and no visited cells: nowhere to stand"
        )
    nav = NavGrid(cells)
    objects = {item.object_id: item for item in map(recorded_object, entries)}
    floor = max(
        (float(o.bounds()[1][1]) for o in objects.values() if o.object_type == "Floor"), default=0.0
    )
    objects = use_trajectory_ids(objects, extra.objects, nav, floor)
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
    add_door_cells(world)
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
