"""Building rooms and houses from a seed: the same name is always the same scene."""

import zlib
from collections.abc import Callable

import numpy as np

from infthor_sim.errors import SimulatorError
from infthor_sim.geometry import level_gaps
from infthor_sim.scenes.furnishing import (
    decorate,
    furnish_bathroom,
    furnish_bedroom,
    furnish_kitchen,
    furnish_living_room,
)
from infthor_sim.scenes.roomplan import RoomPlan, build_world
from infthor_sim.world import FLOOR_STYLES, RoomShell, World

_FURNISH: dict[str, Callable[[RoomPlan], None]] = {
    "kitchen": furnish_kitchen,
    "living-room": furnish_living_room,
    "bedroom": furnish_bedroom,
    "bathroom": furnish_bathroom,
}
_FLOORS = {"kitchen": "tiles", "bathroom": "tiles", "bedroom": "carpet", "living-room": "wood"}
_SIZES = {  # metres: least and most width, least and most length
    "kitchen": (4.4, 5.4, 3.8, 4.8),
    "living-room": (4.6, 5.6, 4.6, 5.6),
    "bedroom": (4.4, 5.2, 4.2, 5.0),
    "bathroom": (3.4, 4.2, 3.2, 4.0),
}
_DOOR = 0.5  # half of a doorway's width, metres
_DOOR_SIZE = (2 * _DOOR, 2.05, 0.12)
_DRAWS = 20  # attempts at a scene
_REACHABLE_SHARE = 0.85  # of a room's free floor that the agent must get to
_REACH = 0.75  # metres from a place to stand to a receptacle's box
SCENE_TYPES = (*_FURNISH, "house")


def build_scene(scene_type: str, seed: int) -> World:
    """Return the world of `<scene_type>-<seed>`: the first draw with every room accessible."""
    for attempt in range(_DRAWS):
        # Each attempt of each scene has a random stream of its own, whatever the attempts before it
        # drew.
        random = np.random.default_rng([zlib.crc32(scene_type.encode()), seed, attempt])
        if scene_type == "house":
            plans, doors = _house_plans(random, seed)
        else:
            plans = [RoomPlan(_shell(scene_type, random, seed), random)]
            doors = []
            _furnish(plans[0], scene_type)
        world = build_world(f"{scene_type}-{seed}", seed, plans, doors)
        if all(_is_accessible(world, plan) for plan in plans):
            return world
    raise SimulatorError(
        f"{scene_type}-{seed}: all {_DRAWS} draws of furniture block the way; use another seed"
    )


def _is_accessible(world: World, plan: RoomPlan) -> bool:
    """Return whether the agent gets to most free floor of a room and near all receptacles."""
    free = plan.free_cells()
    reached = [cell for cell in free if world.nav.can_stand(*cell)]
    if len(reached) < _REACHABLE_SHARE * len(free):
        return False
    cells = np.array(reached)
    for item in plan.objects:
        low, high = item.bounds()
        if item.type.receptacle and level_gaps(cells, low, high).min() > _REACH:
            return False
    return True


def _shell(room_type: str, random: np.random.Generator, seed: int) -> RoomShell:
    """Return a room around (0, 0), of a random size that suits its type."""
    least_x, most_x, least_z, most_z = _SIZES[room_type]
    width = round(random.uniform(least_x, most_x) / 2, 2)
    length = round(random.uniform(least_z, most_z) / 2, 2)
    return RoomShell(-width, width, -length, length, floor_style=_FLOORS[room_type], style=seed)


def _furnish(plan: RoomPlan, room_type: str) -> None:
    """Put in the floor, the furniture of a type of room, and a light switch that is on."""
    room = plan.room
    floor = plan.place(
        "Floor", (room.x_min + room.x_max) / 2, (room.z_min + room.z_max) / 2, y=room.floor - 0.1,
        size=(room.x_max - room.x_min, 0.1, room.z_max - room.z_min),
    )  # fmt: skip
    floor.style = FLOOR_STYLES.index(room.floor_style)
    _FURNISH[room_type](plan)
    switch = plan.try_against("LightSwitch", ["z-", "x-", "x+"], (0.1, 0.14, 0.02), y=1.2)
    if switch is not None:
        switch.state.toggled = True
    decorate(plan, room_type)


def _house_plans(
    random: np.random.Generator, seed: int
) -> tuple[list[RoomPlan], list[tuple[float, float]]]:
    """Return the plans of four rooms, two by two, and the cells in the doorways between them."""
    west = round(random.uniform(4.6, 5.2), 2)
    east = round(random.uniform(4.6, 5.2), 2)
    south = round(random.uniform(4.6, 5.2), 2)
    north = round(random.uniform(4.4, 5.0), 2)
    gap = 0.1  # the thickness of an inner wall
    spans = {
        "living-room": (-west, 0.0, -south, 0.0),
        "bedroom": (gap, east, -south, 0.0),
        "kitchen": (-west, 0.0, gap, north),
        "bathroom": (gap, min(east, 4.2), gap, min(north, 4.2)),
    }
    door_x = -round(west * 0.22, 2)
    door_z = -round(south * 0.72, 2)
    upper_z = round(gap + 1.0, 2)
    openings = {
        "living-room": (_opening("z+", door_x), _opening("x+", door_z)),
        "bedroom": (_opening("x-", door_z),),
        "kitchen": (_opening("z-", door_x), _opening("x+", upper_z)),
        "bathroom": (_opening("x-", upper_z),),
    }
    # the doors open into the rooms that lie behind the living room
    entrances = {
        "bedroom": (gap / 2, door_z, 90.0),
        "kitchen": (door_x, gap / 2, 0.0),
        "bathroom": (gap / 2, upper_z, 90.0),
    }
    plans: list[RoomPlan] = []
    for room_type, span in spans.items():
        style = seed + len(plans)
        doorways = openings[room_type]
        room = RoomShell(*span, floor_style=_FLOORS[room_type], style=style, openings=doorways)
        plan = RoomPlan(room, random)
        plan.keep_doors_free()
        if room_type in entrances:
            door = plan.place("Doorway", *entrances[room_type], size=_DOOR_SIZE)
            door.state.openness = 1.0
        _furnish(plan, room_type)
        plans.append(plan)
    doors = _doorway_cells(door_x, gap / 2, True)
    doors += _doorway_cells(door_z, gap / 2, False)
    doors += _doorway_cells(upper_z, gap / 2, False)
    return plans, doors


def _opening(side: str, middle: float) -> tuple[str, float, float]:
    """Return a doorway as `RoomShell.openings` has it: its wall, and from and to along that."""
    return side, middle - _DOOR, middle + _DOOR


def _doorway_cells(at: float, across: float, along_x: bool) -> list[tuple[float, float]]:
    """Return the cells in a doorway with its middle at `at` along a wall, and the wall at `across`.

    The free floor of each room ends before the wall, so these cells join the rooms.
    """
    lines = [
        v
        for v in np.arange(round((at - _DOOR) * 4), round((at + _DOOR) * 4) + 1) * 0.25
        if abs(v - at) < 0.28
    ]
    steps = np.arange(-3, 4) * 0.25
    near = [s for s in steps if abs(s - across) < 0.4]
    return [(float(a), float(s)) if along_x else (float(s), float(a)) for a in lines for s in near]
