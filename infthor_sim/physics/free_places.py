"""Free places in and on receptacles: clear of things, of drawn parts, and of doors."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array, aabb_overlap, yaw_matrix
from infthor_sim.object_types.record import PLAIN_BOX
from infthor_sim.objects import SimObject
from infthor_sim.physics.receptacles import Surface, drawer_offset, surfaces
from infthor_sim.physics.solids import (
    Box,
    Wall,
    as_open,
    opening_space,
    outline,
    part_boxes,
    vessel_walls,
)
from infthor_sim.world import World

_STEP = 0.05  # metres between the points that are tried
_BELOW_HAND = 0.15  # metres below the agent's own height of the surface that is tried first
_CLEARANCE = 0.008  # metres between neighbours
_SQUEEZE = 0.02  # metres by which recorded insides may be higher than their boxes
_SOFT = 0.01  # metres that covers and cushions rise above the surface they lie on
_TOUCH = 0.004  # metres that what a thing stands on may reach into its box
_ON_IT = 0.05  # metres between a surface and the underside of what stands on it

PointFilter = Callable[[Array], NDArray[np.bool_]]


class InTheWay(Enum):
    """What a thing that is put down must be clear of, beside the loose things around it."""

    DRAWN = "all that is drawn: parts, the inside of vessels, doors, walls"
    FIXED = "boxes of what is fixed on the surface, as a recording has them"
    NOTHING = "nothing: a recording's boxes of lamps, appliances and taps are too large"


@dataclass(frozen=True)
class _Obstacles:
    """What is in the way on a surface.

    Attributes:
        loose: boxes of things that may be squeezed against.
        fixed: boxes of what is solid.
        walls: round walls between which a thing must fit.
        squeeze: metres by which a thing may be higher than the surface's headroom.
    """

    loose: list[Box]
    fixed: list[Box]
    walls: list[Wall]
    squeeze: float = 0.0

    def clear_of(
        self, points: Array, size: Array, around: Array, overlap: float
    ) -> NDArray[np.bool_]:
        """Return at which of some points (n, 3) a thing of a size (3,) metres stands clear of all.

        Args:
            around: points of its outline from above, turned as it will be, metres from its middle
                (m, 2).
            overlap: share of their size by which loose things may overlap.
        """
        free = _apart(points, size, self.fixed, 0.0) & _apart(points, size, self.loose, overlap)
        for wall in self.walls:
            free &= wall.holds(points, around)
        return free


def _apart(points: Array, size: Array, boxes: list[Box], overlap: float) -> NDArray[np.bool_]:
    """Return at which points (n, 3) a box of a size (3,), by its underside, is clear of all."""
    free = np.ones(len(points), dtype=bool)
    if not len(points):
        return free
    level = float(points[0, 1])
    half = size / 2 * (1 - overlap)
    gap = _CLEARANCE * (1 - overlap)
    for low, high in boxes:
        if low[1] > level + size[1] or high[1] < level + _TOUCH:
            continue  # above or below what is to stand here
        middle = (low + high) / 2
        other = (high - low) / 2 * (1 - overlap)
        free &= (np.abs(points[:, 0] - middle[0]) > half[0] + other[0] + gap) | (
            np.abs(points[:, 2] - middle[2]) > half[2] + other[2] + gap
        )
    return free


def find_place(
    world: World,
    item: SimObject,
    receptacle: SimObject,
    overlap: float = 0.0,
    random: np.random.Generator | None = None,
    point_filter: PointFilter | None = None,
    in_the_way: InTheWay = InTheWay.DRAWN,
) -> SimObject | None:
    """Return a copy of `item` at the first free place of `receptacle`; None if it is full.

    Args:
        item: object to place, e.g. the held one; it and the world are not changed.
        overlap: share of their size by which neighbours may overlap.
        random: random numbers that choose among the free places; None for the nearest.
        point_filter: function that marks which of some points (n, 3) may be used; None: all.
        in_the_way: what it must be clear of.
    """
    ghost = item.duplicate(item.object_id)
    neighbours = [o.bounds() for o in _neighbours(world, item, receptacle)]
    for surface in _sort_by_reach(world, surfaces(receptacle)):
        obstacles = _obstacles(world, item, receptacle, surface, neighbours, in_the_way)
        for turn in (0.0, 90.0):
            ghost.rotation = np.array([0.0, (surface.yaw + turn) % 360, 0.0])
            around = (
                _outline_with_contents(world, item, ghost) if obstacles.walls else np.zeros((0, 2))
            )
            point = _free_point(
                world, ghost, surface, obstacles, around, overlap, random, point_filter
            )
            if point is not None:
                ghost.place_bottom(point)
                return ghost
    return None


def _obstacles(
    world: World,
    item: SimObject,
    receptacle: SimObject,
    surface: Surface,
    neighbours: list[Box],
    in_the_way: InTheWay,
) -> _Obstacles:
    """Return what is in an object's way on a surface."""
    if in_the_way is InTheWay.DRAWN:
        inside = (receptacle, *world.ancestors(receptacle))
        solid = list(_solid_boxes(world, item, receptacle, surface))
        return _Obstacles(neighbours, solid, [w for outer in inside for w in _inner_walls(outer)])
    fixed = _fixed_on(world, receptacle, surface) if in_the_way is InTheWay.FIXED else ()
    return _Obstacles([*neighbours, *(o.bounds() for o in fixed)], [], [], _SQUEEZE)


def _outline_with_contents(world: World, item: SimObject, ghost: SimObject) -> Array:
    """Return outline points of a thing and its contents, turned as `ghost`; see `outline`."""
    turn = yaw_matrix(float(ghost.rotation[1] - item.rotation[1]))
    parts = [outline(ghost)]
    for content in world.descendants(item):
        spread = outline(content) + (content.center - item.center)[[0, 2]]
        parts.append(spread @ turn[np.ix_([0, 2], [0, 2])].T)
    return np.concatenate(parts)


def _neighbours(world: World, item: SimObject, receptacle: SimObject) -> Iterator[SimObject]:
    """Yield loose objects that could be in the way, in this receptacle and in others."""
    inside = {o.object_id for o in world.descendants(item)} | {item.object_id}
    for other in world.objects.values():
        if other.object_id in inside or other is receptacle or not other.type.pickupable:
            continue
        # Left out: objects on nothing, and those that share the receptacle's own parent. These
        # stand beside it, as plates on the table that a bowl is on.
        if other.parent == receptacle.object_id or (
            other.parent is not None and receptacle.parent != other.parent
        ):
            yield other


def _fixed_on(world: World, receptacle: SimObject, surface: Surface) -> Iterator[SimObject]:
    """Yield what is fixed on the surface: lamps, screens, appliances, taps, burners."""
    for other in world.objects.values():
        if (
            other.type.pickupable
            or other.type.furniture
            or other.type.stacked
            or other is receptacle
        ):
            continue
        if abs(float(other.bounds()[0][1]) - float(surface.center[1])) < _ON_IT:
            yield other


def _solid_boxes(
    world: World, item: SimObject, receptacle: SimObject, surface: Surface
) -> Iterator[Box]:
    """Yield boxes of what stands on a surface or sticks out of it, of doors over it, of walls.

    Rooms whose furniture is known by its shape are measured by that, and not by boxes.
    """
    reach = float(np.hypot(*surface.half) + item.box_size.max())
    low = surface.center - np.array([reach, -_SOFT, reach])
    high = surface.center + np.array([reach, item.box_size.max() * 2, reach])
    around = {outer.object_id for outer in world.ancestors(receptacle)}
    boxes = [
        box for outer in (receptacle, *world.ancestors(receptacle)) for box in _inner_boxes(outer)
    ]
    for other in world.objects.values():
        apart = other is not receptacle and other.object_id not in around
        if apart and not other.type.pickupable and other.object_type != "Floor":
            boxes += _outer_boxes(other, low, high)
    yield from (box for box in boxes if aabb_overlap(*box, low, high))
    yield from _room_walls(world, surface.center)


def _inner_boxes(receptacle: SimObject) -> list[Box]:
    """Return boxes of a receptacle's parts as if open; none where things hang or stick out."""
    if receptacle.type.overhang or receptacle.type.shape == PLAIN_BOX:
        return []
    opened = _opened(receptacle)
    back = drawer_offset(opened) - drawer_offset(receptacle)
    return [(low - back, high - back) for low, high in part_boxes(opened, hollow=True)]


def _opened(receptacle: SimObject) -> SimObject:
    """Return a receptacle as drawn open, inside shown; as it is if it hides nothing."""
    return as_open(receptacle, 1.0) if receptacle.type.encloses else receptacle


def _outer_boxes(other: SimObject, low: Array, high: Array) -> Iterator[Box]:
    """Yield boxes of another object's parts, of what hides its inside, and of its door's room.

    So there is room around the foot of a lamp, as in AI2-THOR, whose colliders are parts too.
    """
    bounds = other.bounds()
    farthest = float(other.box_size.max()) if other.type.hinged or other.type.slides else 0.0
    if not aabb_overlap(bounds[0] - farthest, bounds[1] + farthest, low, high):
        return
    to_open = opening_space(other)
    if to_open is not None:
        yield to_open
    if other.type.encloses and not other.hollow:
        yield bounds
    elif aabb_overlap(*bounds, low, high):
        yield from part_boxes(other)


def _room_walls(world: World, point: Array) -> Iterator[Box]:
    """Yield boxes behind the four walls of the room that a point is in."""
    for room in world.rooms:
        if room.x_min <= point[0] <= room.x_max and room.z_min <= point[2] <= room.z_max:
            far = np.array([1.0, 1.0, 1.0]) * 100
            yield -far, np.array([room.x_min, 100.0, 100.0])
            yield -far, np.array([100.0, 100.0, room.z_min])
            yield np.array([room.x_max, -100.0, -100.0]), far
            yield np.array([-100.0, -100.0, room.z_max]), far


def _inner_walls(receptacle: SimObject) -> list[Wall]:
    """Return the round walls between which things must fit; what stands in dishes may stick out."""
    if receptacle.type.overhang:
        return []
    return vessel_walls(_opened(receptacle))


def _sort_by_reach(world: World, listed: list[Surface]) -> list[Surface]:
    """Return surfaces by ease of reach: near the hand's height, then near the agent, then low."""
    agent = world.agent.position

    def cost(surface: Surface) -> tuple[float, float, float]:
        turned = yaw_matrix(surface.yaw).T @ (agent - surface.center)
        away = np.maximum(np.abs(turned[[0, 2]]) - surface.half, 0.0)
        return (
            round(abs(surface.center[1] - agent[1] + _BELOW_HAND), 3),
            float(np.hypot(*away)),
            float(surface.center[1]),
        )

    return sorted(listed, key=cost)


def _free_point(
    world: World,
    ghost: SimObject,
    surface: Surface,
    obstacles: _Obstacles,
    around: Array,
    overlap: float,
    random: np.random.Generator | None,
    point_filter: PointFilter | None,
) -> Array | None:
    """Return a surface's point (3,) for the underside of `ghost`, clear of obstacles, or None."""
    low, high = ghost.bounds()
    height = high[1] - low[1]
    if height > surface.headroom + obstacles.squeeze:
        return None
    turn = yaw_matrix(surface.yaw)
    local = np.abs(turn.T @ (high - low)) if surface.yaw % 90 == 0 else high - low
    points = _grid(world, surface, (local[0] / 2, local[2] / 2), turn)
    if not len(points):
        return None
    if point_filter is not None:
        points = points[point_filter(points + np.array([0.0, height / 2, 0.0]))]
    chosen = points[obstacles.clear_of(points, high - low, around, overlap)]
    if not len(chosen):
        return None
    return chosen[0] if random is None else chosen[int(random.integers(len(chosen)))]


def _grid(world: World, surface: Surface, half: tuple[float, float], turn: Array) -> Array:
    """Return a surface's points (n, 3) where something of this half size fits, nearest first."""
    spans = [surface.half[i] - half[i] for i in range(2)]
    if min(spans) < -surface.overhang:
        return np.zeros((0, 3))
    axes = []
    for span in spans:
        count = max(1, math.ceil(2 * max(span, 0.0) / _STEP) + 1)
        axes.append(
            np.linspace(-max(span, 0.0), max(span, 0.0), count) if count > 1 else np.zeros(1)
        )
    xs, zs = np.meshgrid(axes[0], axes[1], indexing="ij")
    flat = np.stack([xs.ravel(), np.zeros(xs.size), zs.ravel()], axis=1) @ turn.T + surface.center
    origin = surface.center if surface.from_middle else world.agent.position
    away = np.hypot(flat[:, 0] - origin[0], flat[:, 2] - origin[2])
    # Places within 6 cm of the edge count as farther away than they are: things stand safer, and
    # look so, inside.
    edge = np.maximum(
        0.0,
        0.06 - np.minimum(axes[0].max() - np.abs(xs.ravel()), axes[1].max() - np.abs(zs.ravel())),
    )
    # Rounding and a stable sort make ties independent of the last bits of the agent's position.
    return flat[np.argsort(np.round(away + 3 * edge, 6), kind="stable")]
