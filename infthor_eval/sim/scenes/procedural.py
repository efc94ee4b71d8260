"""Rooms made from a seed: the same name is always the same room."""

import zlib
from collections.abc import Callable

import numpy as np

from infthor_eval.sim.scenes.kitchen import furnish_kitchen
from infthor_eval.sim.scenes.roomplan import RoomPlan, finish
from infthor_eval.sim.world import Room, World

__all__ = ["ROOM_KINDS", "build_room"]

_FURNISH: dict[str, Callable[[RoomPlan], None]] = {"kitchen": furnish_kitchen}
_FLOORS = {"kitchen": "tiles", "bathroom": "tiles", "bedroom": "carpet", "living-room": "wood"}
ROOM_KINDS = tuple(_FURNISH)


def build_room(kind: str, seed: int) -> World:
    """The world of `<kind>-<seed>`."""
    random = np.random.default_rng([zlib.crc32(kind.encode()), seed])
    plan = RoomPlan(shell(kind, random, seed), random)
    lay_floor(plan)
    _FURNISH[kind](plan)
    return finish(f"{kind}-{seed}", seed, [plan])


def shell(kind: str, random: np.random.Generator, seed: int) -> Room:
    """A room of a size that suits its kind, its floor around (0, 0)."""
    width, length = random.uniform(4.2, 5.4) / 2, random.uniform(3.8, 4.8) / 2
    return Room(
        -round(width, 2), round(width, 2), -round(length, 2), round(length, 2), floor_style=_FLOORS[kind], style=seed
    )


def lay_floor(plan: RoomPlan) -> None:
    """The Floor object of a room."""
    room = plan.room
    plan.place(
        "Floor", (room.x_min + room.x_max) / 2, (room.z_min + room.z_max) / 2, y=room.floor - 0.1,
        size=(room.x_max - room.x_min, 0.1, room.z_max - room.z_min),
    )  # fmt: skip
