"""Where things stand: the surfaces of receptacles, what lies on them, and where there is room for one thing more."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from infthor_eval.sim.geometry import Array, yaw_matrix
from infthor_eval.sim.objects import DRAWER_SLIDE, SimObject
from infthor_eval.sim.world import World

__all__ = ["PointFilter", "Surface", "find_place", "has_within", "owner_of", "surfaces"]

_WALL = 0.02  # thickness in metres of the sides and floors of hollow receptacles
_STEP = 0.05
_BELOW_HAND = 0.15  # metres below the agent's own height at which it likes best to put things
_CLEARANCE = 0.008
_ON_IT = 0.05  # metres between a surface and the underside of what stands on it


PointFilter = Callable[[Array], NDArray[np.bool_]]


@dataclass(frozen=True)
class Surface:
    """A horizontal rectangle that things stand on.

    Attributes:
        center: its middle in the world, metres (3,).
        half: half extents along the receptacle's own x and z (2,).
        yaw: rotation of the receptacle in degrees.
        headroom: free height above, metres.
        overhang: how far in metres a thing may stick out beyond the edge.
        from_middle: the first choice is the middle, as walls hide what stands near them; else the agent's side.
    """

    center: Array
    half: tuple[float, float]
    yaw: float
    headroom: float
    overhang: float = 0.03
    from_middle: bool = False


def surfaces(receptacle: SimObject) -> list[Surface]:
    """The surfaces of a receptacle, lowest first."""
    if receptacle.type.levels:
        return _levels_inside(receptacle)
    low, high = receptacle.bounds()
    middle, half = (low + high) / 2, (receptacle.box_size[0] / 2, receptacle.box_size[2] / 2)
    yaw, overhang = float(receptacle.rotation[1]), math.inf if receptacle.type.overhang else 0.03
    if receptacle.type.open_top:
        base = float(low[1]) + min(_WALL, (high[1] - low[1]) * 0.3)
        if receptacle.support is not None:
            base = max(base, float(low[1]) + receptacle.support)
        inner = [max(side * receptacle.type.open_top - _WALL / 2, 0.015) for side in half]
        return [Surface(np.array([middle[0], base, middle[2]]), (inner[0], inner[1]), yaw, math.inf, overhang, True)]
    level = receptacle.surface_height()
    if not receptacle.pieces:
        return [Surface(np.array([middle[0], level, middle[2]]), half, yaw, math.inf, overhang)]
    found = []
    for x0, z0, x1, z1 in receptacle.pieces:
        at = receptacle.center + receptacle.matrix @ np.array([(x0 + x1) / 2, 0.0, (z0 + z1) / 2])
        found.append(Surface(np.array([at[0], level, at[2]]), ((x1 - x0) / 2, (z1 - z0) / 2), yaw, math.inf, overhang))
    return found


def _levels_inside(receptacle: SimObject) -> list[Surface]:
    """The floor and shelves of a cabinet, a fridge or the like, or of a drawer as far as it has come out."""
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
    """How far (3,), in metres, an open drawer's tray has come out of its box; zero for all else."""
    if not receptacle.type.slides or receptacle.state.openness == 0:
        return np.zeros(3)
    matrix = yaw_matrix(float(receptacle.rotation[1]) + receptacle.front)
    return matrix @ np.array([0.0, 0.0, DRAWER_SLIDE * receptacle.front_size[2] * receptacle.state.openness])


def has_within(vessel: SimObject, low: Array, high: Array) -> bool:
    """Whether a box, given by its corners, is within the walls of an open vessel and above its floor; not its rim."""
    if not vessel.type.open_top or (vessel.type.encloses and vessel.state.openness == 0):
        return False
    (cavity,) = surfaces(vessel)
    middle, half = (low + high) / 2, (high - low) / 2
    # The middles of its sides, not its corners: most of what lies in vessels is round.
    sides = np.array([[half[0], 0, 0], [-half[0], 0, 0], [0, 0, half[2]], [0, 0, -half[2]]])
    points = (middle + sides - cavity.center) @ yaw_matrix(cavity.yaw)
    beside = np.abs(points[:, [0, 2]]).max(axis=0) > cavity.half
    return bool(low[1] > cavity.center[1] - _CLEARANCE and not beside.any())


def find_place(
    world: World,
    item: SimObject,
    receptacle: SimObject,
    crowd: float = 0.0,
    random: np.random.Generator | None = None,
    seen: PointFilter | None = None,
    among_fixed: bool = False,
) -> SimObject | None:
    """A copy of `item` standing in the free place of `receptacle` that is nearest to the agent; None if it is full.

    Args:
        world: the world; not changed.
        item: what is to be put, e.g. the held object.
        receptacle: where.
        crowd: how far, as a share of their size, neighbours may overlap.
        random: picks any free place instead of the nearest.
        seen: tells which of some points (n, 3) come into question; None: all.
        among_fixed: it may stand in lamps, appliances and taps, whose boxes in recordings are coarser than they are.
    """
    boxes = [o.bounds() for o in _neighbours(world, item, receptacle)]
    ghost = item.duplicate(item.object_id)
    for surface in _by_reach(world, surfaces(receptacle)):
        fixed = [] if among_fixed else [o.bounds() for o in _standing(world, receptacle, surface)]
        for turn in (0.0, 90.0):
            ghost.rotation = np.array([0.0, (surface.yaw + turn) % 360, 0.0])
            place = _free_point(world, ghost, surface, boxes + fixed, crowd, random, seen)
            if place is not None:
                ghost.place_bottom(place)
                return ghost
    return None


def _neighbours(world: World, item: SimObject, receptacle: SimObject) -> Iterator[SimObject]:
    """What could be in the way: things in this receptacle, and loose ones of others that reach into it."""
    inside = {o.object_id for o in world.descendants(item)} | {item.object_id}
    for other in world.objects.values():
        if other.object_id in inside or other is receptacle or not other.type.pickupable:
            continue
        if other.parent == receptacle.object_id or (other.parent is not None and receptacle.parent != other.parent):
            yield other


def _standing(world: World, receptacle: SimObject, surface: Surface) -> Iterator[SimObject]:
    """What stands on the surface for good: lamps, screens, appliances, taps, burners."""
    for other in world.objects.values():
        if other.type.pickupable or other.type.furniture or other.type.stacked or other is receptacle:
            continue
        if abs(float(other.bounds()[0][1]) - float(surface.center[1])) < _ON_IT:
            yield other


def _by_reach(world: World, found: list[Surface]) -> list[Surface]:
    agent = world.agent.position

    def cost(surface: Surface) -> tuple[float, float, float]:
        turned = yaw_matrix(surface.yaw).T @ (agent - surface.center)
        away = np.maximum(np.abs(turned[[0, 2]]) - surface.half, 0.0)
        return (
            round(abs(surface.center[1] - agent[1] + _BELOW_HAND), 3),
            float(np.hypot(*away)),
            float(surface.center[1]),
        )

    return sorted(found, key=cost)


def _free_point(
    world: World,
    ghost: SimObject,
    surface: Surface,
    boxes: list[tuple[Array, Array]],
    crowd: float,
    random: np.random.Generator | None,
    seen: PointFilter | None,
) -> Array | None:
    low, high = ghost.bounds()
    height = high[1] - low[1]
    if height > surface.headroom + 0.02:
        return None
    turn = yaw_matrix(surface.yaw)
    local = np.abs(turn.T @ (high - low)) if surface.yaw % 90 == 0 else high - low
    points = _grid(world, surface, (local[0] / 2, local[2] / 2), turn)
    if not len(points):
        return None
    if seen is not None:
        points = points[seen(points + np.array([0.0, height / 2, 0.0]))]
    half = (high - low) / 2 * (1 - crowd)
    gap = _CLEARANCE * (1 - crowd)
    free = np.ones(len(points), dtype=bool)
    for other_low, other_high in boxes:
        if other_low[1] > surface.center[1] + height or other_high[1] < surface.center[1] + 0.004:
            continue
        middle, other = (other_low + other_high) / 2, (other_high - other_low) / 2 * (1 - crowd)
        free &= (np.abs(points[:, 0] - middle[0]) > half[0] + other[0] + gap) | (
            np.abs(points[:, 2] - middle[2]) > half[2] + other[2] + gap
        )
    chosen = points[free]
    if not len(chosen):
        return None
    return chosen[0] if random is None else chosen[int(random.integers(len(chosen)))]


def _grid(world: World, surface: Surface, half: tuple[float, float], turn: Array) -> Array:
    """Points (n, 3) of the surface at which something of this half size stands wholly on it, nearest first."""
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
    edge = np.maximum(0.0, 0.06 - np.minimum(axes[0].max() - np.abs(xs.ravel()), axes[1].max() - np.abs(zs.ravel())))
    return flat[np.argsort(np.round(away + 3 * edge, 6), kind="stable")]


def owner_of(world: World, item: SimObject) -> SimObject | None:
    """The receptacle that `item`, by its position alone, stands in or on; None for one in mid-air or on the floor."""
    low, high = item.bounds()
    point = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    best: tuple[float, SimObject] | None = None
    inside = {o.object_id for o in world.descendants(item)}
    for other in world.objects.values():
        if other is item or not other.type.receptacle or other.object_id in inside:
            continue
        cost = _holding_cost(other, point, item)
        if cost is not None and (best is None or cost < best[0]):
            best = (cost, other)
    return None if best is None else best[1]


def _holding_cost(receptacle: SimObject, point: Array, item: SimObject) -> float | None:
    """How far-fetched it is that a thing whose underside is at `point` stands in `receptacle`; None: it does not."""
    low, high = (corner + drawer_offset(receptacle) for corner in receptacle.bounds())
    if not (low[0] - 0.01 <= point[0] <= high[0] + 0.01 and low[2] - 0.01 <= point[2] <= high[2] + 0.01):
        return None
    if receptacle.object_type == "Floor":
        return 5.0
    volume = float(np.prod(np.maximum(high - low, 0.02)))
    if receptacle.type.encloses or receptacle.type.open_top:
        top = (low[1] + high[1]) / 2 if receptacle.type.slides else high[1] - 0.005
        inside = low[1] - _sinking(receptacle) <= point[1] <= top
        if receptacle.type.pickupable and float(np.prod(item.box_size)) > volume:
            return None
        return 0.01 * volume if inside else None
    gap = point[1] - receptacle.surface_height()
    if -0.12 <= gap <= 0.25:
        return 0.1 + abs(gap)
    return 1.0 + abs(gap) if low[1] <= point[1] <= high[1] + 0.05 else None


def _sinking(receptacle: SimObject) -> float:
    """How far below the box of a hollow receptacle, in metres, the underside of its contents may be recorded."""
    if receptacle.type.encloses:
        return 0.12
    return 0.03 if receptacle.type.pickupable else 0.08
