"""The surfaces of receptacles, free places on them, and the receptacle that an object is in or on."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from infthor_eval.sim.geometry import Array, yaw_matrix
from infthor_eval.sim.objects import DRAWER_SLIDE, SimObject
from infthor_eval.sim.world import World

__all__ = ["PointFilter", "Surface", "contains_box", "find_parent", "find_place", "surfaces"]

_WALL = 0.02  # thickness in metres of the sides and floors of hollow receptacles
_STEP = 0.05  # metres between the places that are tried
_BELOW_HAND = 0.15  # metres below the agent's own height of the surface that is tried first
_CLEARANCE = 0.008  # metres between neighbours
_ON_IT = 0.05  # metres between a surface and the underside of what stands on it


PointFilter = Callable[[Array], NDArray[np.bool_]]


@dataclass(frozen=True)
class Surface:
    """A horizontal rectangle that things stand on.

    Attributes:
        center: middle in the world, metres (3,).
        half: half extents along the receptacle's own x and z, metres (2,).
        yaw: rotation of the receptacle in degrees.
        headroom: free height above, metres.
        overhang: metres that a thing may stick out beyond the edge.
        from_middle: places are tried from the middle outwards, as walls hide what stands near them; else from the
            agent's side.
    """

    center: Array
    half: tuple[float, float]
    yaw: float
    headroom: float
    overhang: float = 0.03
    from_middle: bool = False


def surfaces(receptacle: SimObject) -> list[Surface]:
    """Return the surfaces of a receptacle, lowest first."""
    if receptacle.type.levels:
        return _shelves(receptacle)
    low, high = receptacle.bounds()
    middle, half = (low + high) / 2, (receptacle.box_size[0] / 2, receptacle.box_size[2] / 2)
    yaw, overhang = float(receptacle.rotation[1]), math.inf if receptacle.type.overhang else 0.03
    if receptacle.type.open_top:  # a vessel: its only surface is its bottom
        base = float(low[1]) + min(_WALL, (high[1] - low[1]) * 0.3)
        if receptacle.support is not None:
            base = max(base, float(low[1]) + receptacle.support)
        inner = [max(side * receptacle.type.open_top - _WALL / 2, 0.015) for side in half]
        return [Surface(np.array([middle[0], base, middle[2]]), (inner[0], inner[1]), yaw, math.inf, overhang, True)]
    level = receptacle.surface_height()
    if not receptacle.pieces:
        return [Surface(np.array([middle[0], level, middle[2]]), half, yaw, math.inf, overhang)]
    tops = []
    for x0, z0, x1, z1 in receptacle.pieces:
        at = receptacle.center + receptacle.matrix @ np.array([(x0 + x1) / 2, 0.0, (z0 + z1) / 2])
        tops.append(Surface(np.array([at[0], level, at[2]]), ((x1 - x0) / 2, (z1 - z0) / 2), yaw, math.inf, overhang))
    return tops


def _shelves(receptacle: SimObject) -> list[Surface]:
    """Return the floor and shelves inside a cabinet, fridge or the like, or the floor of a drawer where it is now."""
    low, high = receptacle.bounds()
    inner = (max(receptacle.box_size[0] / 2 - _WALL, 0.02), max(receptacle.box_size[2] / 2 - _WALL, 0.02))
    heights = [low[1] + share * (high[1] - low[1]) for share in receptacle.type.levels]
    tops = [*heights[1:], float(high[1]) - _WALL]
    middle, yaw = (low + high) / 2 + drawer_offset(receptacle), float(receptacle.rotation[1])
    return [
        Surface(np.array([middle[0], y, middle[2]]), inner, yaw, top - y, from_middle=True)
        for y, top in zip(heights, tops, strict=True)
    ]


def drawer_offset(receptacle: SimObject) -> Array:
    """Return how far an open drawer has come out of its box, metres (3,); zeros for other objects."""
    if not receptacle.type.slides or receptacle.state.openness == 0:
        return np.zeros(3)
    matrix = yaw_matrix(float(receptacle.rotation[1]) + receptacle.front)
    return matrix @ np.array([0.0, 0.0, DRAWER_SLIDE * receptacle.front_size[2] * receptacle.state.openness])


def contains_box(vessel: SimObject, low: Array, high: Array) -> bool:
    """Return whether a box, given by its corners, is within the walls of an open vessel and above its floor."""
    if not vessel.type.open_top or (vessel.type.encloses and vessel.state.openness == 0):
        return False
    (cavity,) = surfaces(vessel)
    middle, half = (low + high) / 2, (high - low) / 2
    # The middles of its sides, not its corners, must be inside: most of what lies in vessels is round.
    sides = np.array([[half[0], 0, 0], [-half[0], 0, 0], [0, 0, half[2]], [0, 0, -half[2]]])
    points = (middle + sides - cavity.center) @ yaw_matrix(cavity.yaw)
    beside = np.abs(points[:, [0, 2]]).max(axis=0) > cavity.half
    return bool(low[1] > cavity.center[1] - _CLEARANCE and not beside.any())


def find_place(
    world: World,
    item: SimObject,
    receptacle: SimObject,
    overlap: float = 0.0,
    random: np.random.Generator | None = None,
    point_filter: PointFilter | None = None,
    among_fixed: bool = False,
) -> SimObject | None:
    """Return a copy of `item` at the first free place of `receptacle`; None if it is full.

    Args:
        item: object to place, e.g. the held one; it and the world are not changed.
        overlap: share of their size by which neighbours may overlap.
        random: random numbers that choose among the free places; None for the nearest.
        point_filter: function that marks which of some points (n, 3) may be used; None: all.
        among_fixed: allow places within lamps, appliances and taps: their recorded boxes are too large.
    """
    boxes = [o.bounds() for o in _neighbours(world, item, receptacle)]
    ghost = item.duplicate(item.object_id)
    for surface in _sort_by_reach(world, surfaces(receptacle)):
        fixed = [] if among_fixed else [o.bounds() for o in _fixed_on(world, receptacle, surface)]
        for turn in (0.0, 90.0):
            ghost.rotation = np.array([0.0, (surface.yaw + turn) % 360, 0.0])
            place = _free_point(world, ghost, surface, boxes + fixed, overlap, random, point_filter)
            if place is not None:
                ghost.place_bottom(place)
                return ghost
    return None


def _neighbours(world: World, item: SimObject, receptacle: SimObject) -> Iterator[SimObject]:
    """Yield the loose objects that could be in the way: those in this receptacle, and those of other receptacles."""
    inside = {o.object_id for o in world.descendants(item)} | {item.object_id}
    for other in world.objects.values():
        if other.object_id in inside or other is receptacle or not other.type.pickupable:
            continue
        # Left out: objects on nothing, and those that share the receptacle's own parent. These stand beside it, as
        # plates on the table that a bowl is on.
        if other.parent == receptacle.object_id or (other.parent is not None and receptacle.parent != other.parent):
            yield other


def _fixed_on(world: World, receptacle: SimObject, surface: Surface) -> Iterator[SimObject]:
    """Yield what stands on the surface and cannot be picked up: lamps, screens, appliances, taps, burners."""
    for other in world.objects.values():
        if other.type.pickupable or other.type.furniture or other.type.stacked or other is receptacle:
            continue
        if abs(float(other.bounds()[0][1]) - float(surface.center[1])) < _ON_IT:
            yield other


def _sort_by_reach(world: World, listed: list[Surface]) -> list[Surface]:
    """Return surfaces, the easiest for the agent to reach first: near its hand's height, then near it, then low."""
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
    boxes: list[tuple[Array, Array]],
    overlap: float,
    random: np.random.Generator | None,
    point_filter: PointFilter | None,
) -> Array | None:
    """Return the point (3,) of a surface for the underside of `ghost`, clear of `boxes`; None if there is none."""
    low, high = ghost.bounds()
    height = high[1] - low[1]
    if height > surface.headroom + 0.02:
        return None
    turn = yaw_matrix(surface.yaw)
    local = np.abs(turn.T @ (high - low)) if surface.yaw % 90 == 0 else high - low
    points = _grid(world, surface, (local[0] / 2, local[2] / 2), turn)
    if not len(points):
        return None
    if point_filter is not None:
        points = points[point_filter(points + np.array([0.0, height / 2, 0.0]))]
    half = (high - low) / 2 * (1 - overlap)
    gap = _CLEARANCE * (1 - overlap)
    free = np.ones(len(points), dtype=bool)
    for other_low, other_high in boxes:
        if other_low[1] > surface.center[1] + height or other_high[1] < surface.center[1] + 0.004:
            continue  # above or below what is to stand here
        middle, other = (other_low + other_high) / 2, (other_high - other_low) / 2 * (1 - overlap)
        free &= (np.abs(points[:, 0] - middle[0]) > half[0] + other[0] + gap) | (
            np.abs(points[:, 2] - middle[2]) > half[2] + other[2] + gap
        )
    chosen = points[free]
    if not len(chosen):
        return None
    return chosen[0] if random is None else chosen[int(random.integers(len(chosen)))]


def _grid(world: World, surface: Surface, half: tuple[float, float], turn: Array) -> Array:
    """Return points (n, 3) of the surface at which something of this half size fits on it, nearest first."""
    spans = [surface.half[i] - half[i] for i in range(2)]
    if min(spans) < -surface.overhang:
        return np.zeros((0, 3))
    axes = []
    for span in spans:
        count = max(1, math.ceil(2 * max(span, 0.0) / _STEP) + 1)
        axes.append(np.linspace(-max(span, 0.0), max(span, 0.0), count) if count > 1 else np.zeros(1))
    xs, zs = np.meshgrid(axes[0], axes[1], indexing="ij")
    flat = np.stack([xs.ravel(), np.zeros(xs.size), zs.ravel()], axis=1) @ turn.T + surface.center
    origin = surface.center if surface.from_middle else world.agent.position
    away = np.hypot(flat[:, 0] - origin[0], flat[:, 2] - origin[2])
    # Places within 6 cm of the edge count as farther away than they are: things stand safer, and look so, inside.
    edge = np.maximum(0.0, 0.06 - np.minimum(axes[0].max() - np.abs(xs.ravel()), axes[1].max() - np.abs(zs.ravel())))
    # Rounding and a stable sort make ties independent of the last bits of the agent's position.
    return flat[np.argsort(np.round(away + 3 * edge, 6), kind="stable")]


def find_parent(world: World, item: SimObject) -> SimObject | None:
    """Return the receptacle that an object is in or on, judged by its position alone; None in mid-air."""
    low, high = item.bounds()
    point = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    best: tuple[float, SimObject] | None = None
    inside = {o.object_id for o in world.descendants(item)}
    for other in world.objects.values():
        if other is item or not other.type.receptacle or other.object_id in inside:
            continue
        cost = _parent_cost(other, point, item)
        if cost is not None and (best is None or cost < best[0]):
            best = (cost, other)
    return None if best is None else best[1]


def _parent_cost(receptacle: SimObject, point: Array, item: SimObject) -> float | None:
    """Return how unlikely it is that an object whose underside is at `point` is in a receptacle; None: it is not.

    Hollow receptacles come before surfaces, small before large ones, and the floor last.
    """
    low, high = (corner + drawer_offset(receptacle) for corner in receptacle.bounds())
    if not (low[0] - 0.01 <= point[0] <= high[0] + 0.01 and low[2] - 0.01 <= point[2] <= high[2] + 0.01):
        return None
    if receptacle.object_type == "Floor":
        return 5.0
    volume = float(np.prod(np.maximum(high - low, 0.02)))
    if receptacle.type.encloses or receptacle.type.open_top:
        top = (low[1] + high[1]) / 2 if receptacle.type.slides else high[1] - 0.005
        inside = low[1] - _depth_below(receptacle) <= point[1] <= top
        if receptacle.type.pickupable and float(np.prod(item.box_size)) > volume:
            return None
        return 0.01 * volume if inside else None
    gap = point[1] - receptacle.surface_height()
    if -0.12 <= gap <= 0.25:
        return 0.1 + abs(gap)
    return 1.0 + abs(gap) if low[1] <= point[1] <= high[1] + 0.05 else None


def _depth_below(receptacle: SimObject) -> float:
    """Return metres below the box of a hollow receptacle at which the underside of its contents may be recorded."""
    if receptacle.type.encloses:
        return 0.12
    return 0.03 if receptacle.type.pickupable else 0.08
