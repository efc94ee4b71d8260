"""Floors, walls and ceilings of the rooms."""

import numpy as np

from infthor_eval.sim.geometry import Array
from infthor_eval.sim.render.primitives import Color, Kind, Material, Part, rows
from infthor_eval.sim.world import Room, World

__all__ = ["SHELL_NAMES", "shell_rows"]

SHELL_NAMES = ("Wall", "Ceiling", "Ground")
_WALLS: tuple[Color, ...] = (
    (0.86, 0.82, 0.74), (0.74, 0.80, 0.82), (0.82, 0.76, 0.72), (0.76, 0.81, 0.73), (0.83, 0.83, 0.80),
)  # fmt: skip
_FLOORS: dict[str, tuple[Color, Material]] = {
    "wood": ((0.62, 0.44, 0.29), Material.PLANKS),
    "tiles": ((0.78, 0.76, 0.72), Material.TILES),
    "carpet": ((0.60, 0.56, 0.52), Material.CARPET),
}
_THICK = 0.05
_DOOR = 2.05


def shell_rows(world: World) -> Array:
    """Rows (n, COLUMNS) of all rooms; instance 0 are walls, 1 ceilings, 2 the ground where no Floor object is."""
    origin, straight = np.zeros(3), np.eye(3)
    made = []
    for room in world.rooms:
        made.append(rows(_walls(room), origin, straight, 0))
        width, length = (room.x_max - room.x_min) / 2, (room.z_max - room.z_min) / 2
        middle = ((room.x_max + room.x_min) / 2, (room.z_max + room.z_min) / 2)
        ceiling = Part(
            Kind.BOX, (middle[0], room.height + _THICK, middle[1]), (width, _THICK, length), (0.9, 0.9, 0.88)
        )
        made.append(rows([ceiling], origin, straight, 1))
        color, material = _FLOORS[room.floor_style]
        ground = Part(
            Kind.BOX, (middle[0], room.floor - _THICK - 0.002, middle[1]), (width, _THICK, length), color, material
        )
        made.append(rows([ground], origin, straight, 2))
    return np.concatenate(made)


def _walls(room: Room) -> list[Part]:
    color = _WALLS[room.style % len(_WALLS)]
    trim: Color = (0.93, 0.92, 0.9)
    parts = []
    for side in ("x-", "x+", "z-", "z+"):
        along_x = side[0] == "z"
        start, end = (room.x_min, room.x_max) if along_x else (room.z_min, room.z_max)
        at = {
            "x-": room.x_min - _THICK,
            "x+": room.x_max + _THICK,
            "z-": room.z_min - _THICK,
            "z+": room.z_max + _THICK,
        }
        doors = sorted((a, b) for s, a, b in room.openings if s == side)
        for low, high, bottom in _pieces(start, end, doors, room.floor):
            if high - low < 1e-6:
                continue
            middle, half = (low + high) / 2, (high - low) / 2
            level, rise = (bottom + room.height) / 2, (room.height - bottom) / 2
            parts.append(_slab(along_x, middle, at[side[0] + side[1]], half, level, rise, _THICK, color))
            if bottom == room.floor:
                parts.append(
                    _slab(along_x, middle, at[side[0] + side[1]], half, room.floor + 0.05, 0.05, _THICK + 0.008, trim)
                )
    return parts


def _pieces(
    start: float, end: float, doors: list[tuple[float, float]], floor: float
) -> list[tuple[float, float, float]]:
    """Stretches of wall as (from, to, bottom): whole ones between doorways, and those above them."""
    made, at = [], start
    for low, high in doors:
        made += [(at, low, floor), (low, high, floor + _DOOR)]
        at = high
    return [*made, (at, end, floor)]


def _slab(
    along_x: bool, middle: float, at: float, half: float, level: float, rise: float, thick: float, color: Color
) -> Part:
    if along_x:
        return Part(Kind.BOX, (middle, level, at), (half, rise, thick), color)
    return Part(Kind.BOX, (at, level, middle), (thick, rise, half), color)
