"""Floors, walls and ceilings of the rooms."""

import numpy as np

from infthor_sim.geometry import Array, yaw_matrix
from infthor_sim.render.primitives import Color, Form, Material, ShapePart, rows
from infthor_sim.render.shapes.builder import shade_of
from infthor_sim.render.shapes.palette import CHROME, FLOORS, WOODS, pick
from infthor_sim.world import RoomShell, Wall, World

SHELL_NAMES = ("Wall", "Ceiling", "Ground")
_WALLS: tuple[Color, ...] = (
    (0.86, 0.82, 0.74), (0.74, 0.80, 0.82), (0.82, 0.76, 0.72), (0.76, 0.81, 0.73),
    (0.83, 0.83, 0.80),
)  # fmt: skip
_THICK = 0.05  # half thickness of walls, metres
_DOOR = 2.05  # height of doorways, metres
_TRIM: Color = (0.93, 0.92, 0.9)
_RUG_RISE = 0.004  # of a rug's upper side above the floor, metres
_RUGS: tuple[tuple[Color, Color], ...] = (
    ((0.55, 0.2, 0.2), (0.85, 0.76, 0.6)), ((0.22, 0.32, 0.5), (0.86, 0.86, 0.82)),
    ((0.3, 0.42, 0.34), (0.8, 0.72, 0.5)), ((0.62, 0.45, 0.28), (0.3, 0.24, 0.22)),
    ((0.46, 0.36, 0.5), (0.84, 0.8, 0.84)),
)  # fmt: skip


def shell_rows(world: World) -> Array:
    """Return the primitives (n, COLUMNS) of all rooms; their instances index `SHELL_NAMES`."""
    origin = np.zeros(3)
    straight = np.eye(3)
    parts = []
    for room in world.rooms:
        if room.walled:
            parts.append(rows([*_walls(room), *_door(room)], origin, straight, 0))
        width = (room.x_max - room.x_min) / 2
        length = (room.z_max - room.z_min) / 2
        middle = ((room.x_max + room.x_min) / 2, (room.z_max + room.z_min) / 2)
        ceiling = ShapePart(
            Form.BOX,
            (middle[0], room.height + _THICK, middle[1]),
            (width, _THICK, length),
            (0.9, 0.9, 0.88),
        )
        parts.append(rows([ceiling], origin, straight, 1))
        color, material = FLOORS[room.floor_style]
        parts.append(rows(_thresholds(room, color, material), origin, straight, 2))
        # The ground shows where no Floor object is. It is 2 mm lower, so that the two do not
        # coincide.
        ground = ShapePart(
            Form.BOX,
            (middle[0], room.floor - _THICK - 0.002, middle[1]),
            (width, _THICK, length),
            color,
            material,
        )
        parts.append(rows([ground, *_rug(room)], origin, straight, 2))
    parts.append(rows([_wall_part(wall) for wall in world.walls], origin, straight, 0))
    return np.concatenate(parts)


def _wall_part(wall: Wall) -> ShapePart:
    along = np.array([wall.x1 - wall.x0, wall.z1 - wall.z0])
    length = float(np.hypot(*along))
    yaw = float(np.degrees(np.arctan2(along[0], along[1])))
    center = ((wall.x0 + wall.x1) / 2, (wall.bottom + wall.top) / 2, (wall.z0 + wall.z1) / 2)
    half = (_THICK, (wall.top - wall.bottom) / 2, length / 2 + _THICK)
    return ShapePart(
        Form.BOX, center, half, _WALLS[wall.style % len(_WALLS)], matrix=yaw_matrix(yaw)
    )


def _walls(room: RoomShell) -> list[ShapePart]:
    """Return the four walls of a room, with doorways and skirting boards."""
    color = _WALLS[room.style % len(_WALLS)]
    at = {
        "x-": room.x_min - _THICK,
        "x+": room.x_max + _THICK,
        "z-": room.z_min - _THICK,
        "z+": room.z_max + _THICK,
    }
    parts = []
    for side in ("x-", "x+", "z-", "z+"):
        along_x = side[0] == "z"
        start, end = (room.x_min, room.x_max) if along_x else (room.z_min, room.z_max)
        doors = sorted((a, b) for s, a, b in room.openings if s == side)
        for low, high, bottom in _pieces(start, end, doors, room.floor):
            if high - low < 1e-6:
                continue
            middle = (low + high) / 2
            half = (high - low) / 2
            level = (bottom + room.height) / 2
            rise = (room.height - bottom) / 2
            parts.append(_slab(along_x, middle, at[side], half, level, rise, _THICK, color))
            if bottom == room.floor:
                parts.append(
                    _slab(
                        along_x,
                        middle,
                        at[side],
                        half,
                        room.floor + 0.05,
                        0.05,
                        _THICK + 0.008,
                        _TRIM,
                    )
                )
    return parts


def _door(room: RoomShell) -> list[ShapePart]:
    """Return the closed door of a room that has one: a frame, a leaf with panels, a handle."""
    if room.door is None:
        return []
    side, middle = room.door
    inward = 1 if side[1] == "-" else -1
    face = {"x-": room.x_min, "x+": room.x_max, "z-": room.z_min, "z+": room.z_max}[side]
    wood = pick(WOODS, room.style)
    # along the wall, height, half width, half height, metres into the room, colour
    listed: list[tuple[float, float, float, float, float, Color]] = [
        (0.0, 1.03, 0.48, 1.03, 0.02, _TRIM),
        (0.0, 1.0, 0.41, 1.0, 0.03, wood),
        (0.0, 0.5, 0.28, 0.32, 0.035, shade_of(wood, 0.8)),
        (0.0, 1.42, 0.28, 0.42, 0.035, shade_of(wood, 0.8)),
        (0.34, 1.0, 0.015, 0.08, 0.04, CHROME),
        (0.29, 1.02, 0.06, 0.014, 0.08, CHROME),
    ]  # fmt: skip
    return [
        _slab(side[0] == "z", middle + along, face + inward * out / 2, half, room.floor + level,
              rise, out / 2, color)
        for along, level, half, rise, out, color in listed
    ]  # fmt: skip


def _rug(room: RoomShell) -> list[ShapePart]:
    """Return the rug of a room that has one: a border around a middle with stripes."""
    if room.rug is None:
        return []
    x_min, x_max, z_min, z_max = room.rug
    x = (x_min + x_max) / 2
    z = (z_min + z_max) / 2
    half = ((x_max - x_min) / 2, (z_max - z_min) / 2)
    outer, inner = _RUGS[room.style % len(_RUGS)]
    listed = [(1.0, 1.0, 0.0, outer), (0.88, 0.84, 0.0, inner), (0.78, 0.7, 0.0, outer)]
    listed += [(0.04, 0.7, at, inner) for at in (-0.45, 0.0, 0.45)]
    return [
        ShapePart(
            Form.BOX,
            (x + along * half[0], room.floor + 0.0003 * index, z),
            (half[0] * wide, _RUG_RISE, half[1] * deep),
            color,
            Material.CARPET,
        )
        for index, (wide, deep, along, color) in enumerate(listed)
    ]


def _thresholds(room: RoomShell, color: Color, material: Material) -> list[ShapePart]:
    """Return the floor within the thickness of the walls, in doorways."""
    level = room.floor - _THICK - 0.001
    parts = []
    for side, low, high in room.openings:
        middle = (low + high) / 2
        half = (high - low) / 2
        at = {"x-": room.x_min, "x+": room.x_max, "z-": room.z_min, "z+": room.z_max}[side]
        parts.append(
            _slab(side[0] == "z", middle, at, half, level, _THICK, 2 * _THICK, color, material)
        )
    return parts


def _pieces(
    start: float, end: float, doors: list[tuple[float, float]], floor: float
) -> list[tuple[float, float, float]]:
    """Return a wall's stretches (from, to, bottom): whole ones, and those above doorways."""
    stretches = []
    at = start
    for low, high in doors:
        stretches += [(at, low, floor), (low, high, floor + _DOOR)]
        at = high
    return [*stretches, (at, end, floor)]


def _slab(
    along_x: bool,
    middle: float,
    at: float,
    half: float,
    level: float,
    rise: float,
    thick: float,
    color: Color,
    material: Material = Material.PLAIN,
) -> ShapePart:
    if along_x:
        return ShapePart(Form.BOX, (middle, level, at), (half, rise, thick), color, material)
    return ShapePart(Form.BOX, (at, level, middle), (thick, rise, half), color, material)
