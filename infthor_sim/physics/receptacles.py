"""The surfaces of receptacles, and the receptacle that an object is in or on."""

import math
from dataclasses import dataclass

import numpy as np

from infthor_sim.geometry import Array, yaw_matrix
from infthor_sim.objects import DRAWER_SLIDE, WALL, SimObject
from infthor_sim.physics.footprints import Rect
from infthor_sim.world import World

_TOUCH = 0.008  # metres by which what stands on a vessel's floor may reach into it
# metres: what a recorded box may lack at its sides, a floor above its height, a sink at its rim
_BESIDE = 0.01
_ON_FLOOR = 0.03
_RIM = 0.005
# costs of parents: of a floor far below, and most of a surface that a thing stands on by its edge
_FAR_ABOVE = 5.0
_TOUCHING = 0.12


@dataclass(frozen=True)
class Surface:
    """A horizontal rectangle that things stand on.

    Attributes:
        center: middle in the world, metres (3,).
        half: half extents along the receptacle's own x and z, metres (2,).
        yaw: rotation of the receptacle in degrees.
        headroom: free height above, metres.
        overhang: metres that a thing may stick out beyond the edge.
        from_middle: places are tried from the middle outwards, as walls hide what stands near them;
            else from the agent's side.
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
    middle, half = _standing_area(receptacle)
    yaw = float(receptacle.rotation[1])
    overhang = math.inf if receptacle.type.overhang else 0.03
    if receptacle.type.open_top:  # a vessel: its only surface is its bottom
        base = float(receptacle.bounds()[0][1]) + receptacle.floors[0]
        inner = [max(side * receptacle.type.open_top - WALL / 2, 0.015) for side in half]
        return [
            Surface(
                np.array([middle[0], base, middle[2]]),
                (inner[0], inner[1]),
                yaw,
                math.inf,
                overhang,
                True,
            )
        ]
    level = receptacle.surface_height()
    if not receptacle.pieces:
        return [Surface(np.array([middle[0], level, middle[2]]), half, yaw, math.inf, overhang)]
    tops = []
    for x0, z0, x1, z1 in receptacle.pieces:
        at = receptacle.center + receptacle.matrix @ np.array([(x0 + x1) / 2, 0.0, (z0 + z1) / 2])
        tops.append(
            Surface(
                np.array([at[0], level, at[2]]),
                ((x1 - x0) / 2, (z1 - z0) / 2),
                yaw,
                math.inf,
                overhang,
            )
        )
    return tops


def _standing_area(receptacle: SimObject) -> tuple[Array, tuple[float, float]]:
    """Return middle (3,), in the world, and half extents (2,) of where things stand in a box.

    Its height is that of the box's middle.
    """
    half_x, _, half_z = (receptacle.box_size / 2).tolist()
    x0, z0, x1, z1 = receptacle.type.area or _body(receptacle)
    offset = np.array([(x0 + x1) / 2 * half_x, 0.0, (z0 + z1) / 2 * half_z])
    return receptacle.center + receptacle.matrix @ offset, (
        (x1 - x0) / 2 * half_x,
        (z1 - z0) / 2 * half_z,
    )


def _body(receptacle: SimObject) -> Rect:
    """Return the part of a box without handle or carton flaps, as shares of its half."""
    width, _, depth = receptacle.box_size.tolist()
    if receptacle.type.handled:
        return (-1.0, -1.0, min(1.0, 2 * depth / width - 1), min(1.0, 2 * width / depth - 1))
    x = _closed_share(receptacle, axis=0)
    z = _closed_share(receptacle, axis=2)
    return (-x, -z, x, z)


def _closed_share(receptacle: SimObject, axis: int) -> float:
    """Return the extent of a box along an axis when it is closed, as a share of what it is now."""
    size = float(receptacle.box_size[axis])
    for change in receptacle.type.unfolds:
        if change.axis == axis:
            return change.extent(size, receptacle.state.openness, 0.0) / size
    return 1.0


def _shelves(receptacle: SimObject) -> list[Surface]:
    """Return floor and shelves in a cabinet, fridge or the like, or a drawer's moved floor."""
    low, high = receptacle.bounds()
    inner = (
        max(receptacle.box_size[0] / 2 - WALL, 0.02),
        max(receptacle.box_size[2] / 2 - WALL, 0.02),
    )
    heights = [float(low[1]) + floor for floor in receptacle.floors]
    tops = [*heights[1:], float(high[1]) - WALL]
    middle = (low + high) / 2 + drawer_offset(receptacle)
    yaw = float(receptacle.rotation[1])
    return [
        Surface(np.array([middle[0], y, middle[2]]), inner, yaw, top - y, from_middle=True)
        for y, top in zip(heights, tops, strict=True)
    ]


def drawer_offset(receptacle: SimObject) -> Array:
    """Return how far an open drawer is out of its box, metres (3,); zeros for other objects."""
    if not receptacle.type.slides or receptacle.state.openness == 0:
        return np.zeros(3)
    matrix = yaw_matrix(float(receptacle.rotation[1]) + receptacle.front)
    return matrix @ np.array(
        [0.0, 0.0, DRAWER_SLIDE * receptacle.front_size[2] * receptacle.state.openness]
    )


def contains_box(vessel: SimObject, low: Array, high: Array) -> bool:
    """Return whether a box, by its corners, is within an open vessel and above its floor."""
    if not vessel.type.open_top or (vessel.type.encloses and vessel.state.openness == 0):
        return False
    (cavity,) = surfaces(vessel)
    middle = (low + high) / 2
    half = (high - low) / 2
    # The middles of its sides, not its corners, must be inside: most of what lies in vessels is
    # round.
    sides = np.array([[half[0], 0, 0], [-half[0], 0, 0], [0, 0, half[2]], [0, 0, -half[2]]])
    points = (middle + sides - cavity.center) @ yaw_matrix(cavity.yaw)
    beside = np.abs(points[:, [0, 2]]).max(axis=0) > cavity.half
    return bool(low[1] > cavity.center[1] - _TOUCH and not beside.any())


def find_parent(world: World, item: SimObject) -> SimObject | None:
    """Return the receptacle that an object is in or on, by position alone; None in mid-air."""
    low, high = item.bounds()
    inside = {o.object_id for o in world.descendants(item)}
    others = [
        o
        for o in world.objects.values()
        if o is not item and o.type.receptacle and o.object_id not in inside
    ]
    cost, parent = _likeliest(others, item, _BESIDE)
    if cost < _FAR_ABOVE:
        return parent
    # There is nothing near below its middle: it stands on what is below its edge.
    flat = [o for o in others if not (o.type.encloses or o.type.open_top)]
    at_edge, beside = _likeliest(flat, item, float(min(high[0] - low[0], high[2] - low[2])) / 2)
    return beside if at_edge < _TOUCHING else parent if cost < math.inf else None


def _likeliest(
    receptacles: list[SimObject], item: SimObject, reach: float
) -> tuple[float, SimObject | None]:
    """Return the least cost of a receptacle as an object's parent, and the receptacle."""
    low, high = item.bounds()
    point = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    costs = (
        (_parent_cost(receptacle, point, item, reach), receptacle) for receptacle in receptacles
    )
    return min(costs, key=lambda pair: pair[0], default=(math.inf, None))


def _parent_cost(receptacle: SimObject, point: Array, item: SimObject, reach: float) -> float:
    """Return how unlikely it is that the object above `point` is in a receptacle; infinite: not.

    Hollow receptacles come before surfaces, small before large ones. The floor comes before
    furniture of which it is not known that things stand so low in it, and else last. `reach` is
    how many metres `point` may be beside the receptacle.
    """
    low, high = receptacle.bounds()
    if receptacle.type.slides:
        low, high = low + drawer_offset(receptacle), high + drawer_offset(receptacle)
    if not (
        low[0] - reach <= point[0] <= high[0] + reach
        and low[2] - reach <= point[2] <= high[2] + reach
    ):
        return math.inf
    gap = float(point[1]) - receptacle.surface_height()
    if receptacle.object_type == "Floor":
        return 0.9 if gap <= _ON_FLOOR else _FAR_ABOVE
    if receptacle.type.encloses or receptacle.type.open_top:
        # Things stand on the rim of a sink, but on no other one's.
        rim = _RIM if receptacle.pieces else -_RIM
        top = (low[1] + high[1]) / 2 if receptacle.type.slides else high[1] + rim
        inside = low[1] - _depth_below(receptacle) <= point[1] <= top
        volume = float(np.prod(np.maximum(high - low, 0.02)))
        if receptacle.type.open_top:  # not beside it, under its handle or flaps
            middle, half = _standing_area(receptacle)
            x, _, z = np.abs(yaw_matrix(float(receptacle.rotation[1])).T @ (point - middle))
            inside = inside and bool(x <= half[0] and z <= half[1])
        if not inside or (receptacle.type.pickupable and float(np.prod(item.box_size)) > volume):
            return math.inf
        return 0.01 * volume
    if -0.12 <= gap <= 0.25:
        return 0.1 + abs(gap)
    return 1.0 + abs(gap) if low[1] <= point[1] <= high[1] + 0.05 else math.inf


def _depth_below(receptacle: SimObject) -> float:
    """Return metres that contents may be recorded below the box of a hollow receptacle."""
    if receptacle.type.encloses:
        return 0.12
    return 0.03 if receptacle.type.pickupable else 0.08
