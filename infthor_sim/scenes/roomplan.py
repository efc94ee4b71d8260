"""Furnishing a room: what stands where, the floor that stays free, and the loose objects."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from infthor_sim.agent import AGENT_HEIGHT, AGENT_RADIUS, Agent
from infthor_sim.geometry import Array, aabb_overlap, level_gaps
from infthor_sim.object_types import allowed_in, type_named
from infthor_sim.objects import SimObject, default_object
from infthor_sim.physics.doorways import update_floor
from infthor_sim.physics.footprints import Rect, subtract
from infthor_sim.physics.free_places import find_place
from infthor_sim.physics.navigation import CELL, NavGrid
from infthor_sim.physics.solids import Box, opening_space
from infthor_sim.world import RoomShell, World

_BODY = 0.23  # the agent's radius and a margin, metres
# heights in metres between which an object takes floor from the agent
_KNEE = 0.1
_HEAD = 1.6
_CLEAR = 0.9  # metres of floor in front of a doorway


class RoomPlan:
    """The furniture of one rectangular room.

    Args:
        room: shell of the room.
        random: random numbers that decide everything that varies.

    Attributes:
        objects: furniture and fixtures so far.
        loose: types of the loose objects to scatter.
        reserved: boxes that must stay free: before doorways, doors and drawers, below towel rails.
    """

    def __init__(self, room: RoomShell, random: np.random.Generator) -> None:
        self.room = room
        self.random = random
        self.objects: list[SimObject] = []
        self.loose: list[str] = []
        self.reserved: list[tuple[Array, Array]] = []

    def place(
        self,
        object_type: str,
        x: float,
        z: float,
        yaw: float = 0.0,
        y: float = 0.0,
        size: tuple[float, float, float] | None = None,
    ) -> SimObject:
        """Put an object's underside at (x, y, z); the space of its door stays free."""
        item = self._at(object_type, x, z, yaw, y, size)
        self._add(item)
        return item

    def _add(self, item: SimObject) -> None:
        self.objects.append(item)
        to_open = opening_space(item)
        if to_open is not None:
            self.reserved.append(to_open)

    @staticmethod
    def _at(
        object_type: str,
        x: float,
        z: float,
        yaw: float,
        y: float,
        size: tuple[float, float, float] | None,
    ) -> SimObject:
        # Two steps, as the id names the object's origin, which follows from its box.
        item = default_object(
            object_type, np.zeros(3), yaw, None if size is None else np.array(size)
        )
        item.place_bottom(np.array([x, y, z]))
        named = default_object(object_type, np.round(item.position, 4), yaw, item.box_size)
        named.support = item.support
        return named

    def place_against(
        self,
        side: str,
        object_type: str,
        at: float,
        y: float = 0.0,
        size: tuple[float, float, float] | None = None,
        gap: float = 0.0,
    ) -> SimObject:
        """Put an object with its back to a wall.

        Args:
            side: the wall: `x-`, `x+`, `z-` or `z+`.
            at: position along the wall, metres (x for z walls, z for x walls).
            y: height of its underside, metres.
            size: width, height and depth, metres; None for the type's usual size.
            gap: distance from the wall, metres.
        """  # fmt: skip
        item = self._against(side, object_type, at, y, size, gap)
        self._add(item)
        return item

    def _against(
        self,
        side: str,
        object_type: str,
        at: float,
        y: float,
        size: tuple[float, float, float] | None,
        gap: float,
    ) -> SimObject:
        depth = (type_named(object_type).size if size is None else size)[2] / 2 + gap
        room = self.room
        x, z, yaw = {
            "z+": (at, room.z_max - depth, 180.0),
            "z-": (at, room.z_min + depth, 0.0),
            "x+": (room.x_max - depth, at, 270.0),
            "x-": (room.x_min + depth, at, 90.0),
        }[side]
        return self._at(object_type, x, z, yaw, y, size)

    def shuffle(self, options: Sequence[str]) -> list[str]:
        """Return walls or types in a random order."""
        return [str(option) for option in self.random.permutation(options)]

    def span(self, side: str) -> tuple[float, float]:
        """Return the two ends of a wall along its length, metres."""
        room = self.room
        return (room.x_min, room.x_max) if side[0] == "z" else (room.z_min, room.z_max)

    def is_clear(self, low: Array, high: Array, margin: float | Array = 0.0) -> bool:
        """Return whether a box, grown by a margin, touches no furniture and no reserved space."""
        return self._is_empty(low - margin, high + margin) and not any(
            aabb_overlap(low - margin, high + margin, a, b) for a, b in self.reserved
        )

    def _is_empty(self, low: Array, high: Array) -> bool:
        """Return whether a box touches no furniture."""
        return not any(
            aabb_overlap(low, high, *o.bounds()) for o in self.objects if o.object_type != "Floor"
        )

    def try_against(
        self,
        object_type: str,
        sides: Iterable[str],
        size: tuple[float, float, float] | None = None,
        y: float = 0.0,
        margin: float | Array | None = None,
    ) -> SimObject | None:
        """Put an object at a random free place along the first wall that has one, or None.

        `margin` is what stays free around it, metres; None for 5 cm on the floor, 1 cm on walls.
        """
        width = (type_named(object_type).size if size is None else size)[0]
        if margin is None:
            margin = 0.05 if y == 0 else 0.01
        for side in sides:
            for at in self.places(side, width):
                item = self._against(side, object_type, at, y, size, gap=0.02 if y == 0 else 0.0)
                to_open = opening_space(item)
                if not (to_open is None or self._is_empty(*to_open)):
                    continue
                if self.is_clear(*item.bounds(), margin):
                    self._add(item)
                    return item
        return None

    def places(self, side: str, width: float) -> Iterator[float]:
        """Yield, in a random order, where along a wall a width fits beside its doorways, metres."""
        start, end = self.span(side)
        listed = np.arange(start + width / 2 + 0.1, end - width / 2 - 0.1 + 1e-6, 0.15)
        for at in self.random.permutation(listed):
            if not any(
                s == side and a - width / 2 < at < b + width / 2 for s, a, b in self.room.openings
            ):
                yield round(float(at), 2)

    def keep_doors_free(self) -> None:
        """Reserve the floor in front of each doorway."""
        for side, start, end in self.room.openings:
            self.reserved.append(self.space_before(side, start, end, _CLEAR, (0.0, 2.0)))

    def space_before(
        self, side: str, start: float, end: float, depth: float, heights: tuple[float, float]
    ) -> Box:
        """Return the box before a stretch of a wall: so deep, between two heights; metres."""
        room = self.room
        x0, x1, z0, z1 = {
            "x-": (room.x_min, room.x_min + depth, start, end),
            "x+": (room.x_max - depth, room.x_max, start, end),
            "z-": (start, end, room.z_min, room.z_min + depth),
            "z+": (start, end, room.z_max - depth, room.z_max),
        }[side]
        return np.array([x0, heights[0], z0]), np.array([x1, heights[1], z1])

    def free_cells(self) -> list[tuple[float, float]]:
        """Return the cells where the agent fits between what stands on the floor."""
        room = self.room
        boxes = [
            o.bounds() for o in self.objects
            if not (o.object_type == "Floor" or o.type.in_doorway or _is_thin_picture(o))
            and o.bounds()[0][1] < _HEAD
            and o.bounds()[1][1] > _KNEE
        ]  # fmt: skip
        xs = (
            np.arange(
                np.ceil((room.x_min + _BODY) / CELL), np.floor((room.x_max - _BODY) / CELL) + 1
            )
            * CELL
        )
        zs = (
            np.arange(
                np.ceil((room.z_min + _BODY) / CELL), np.floor((room.z_max - _BODY) / CELL) + 1
            )
            * CELL
        )
        cells = np.array([(x, z) for x in xs for z in zs]).reshape(-1, 2)
        for low, high in boxes:
            cells = cells[level_gaps(cells, low, high) >= _BODY]
        return [(float(x), float(z)) for x, z in cells]


def build_world(
    name: str, seed: int, plans: list[RoomPlan], doors: list[tuple[float, float]] | None = None
) -> World:
    """Return the world of furnished rooms: the agent on free floor, loose objects in furniture.

    `doors` are the cells (x, z) in doorways.
    """
    # Of floor that furniture cuts off from the rest, only the largest part can be walked on.
    grid = NavGrid([cell for plan in plans for cell in plan.free_cells()] + (doors or []))
    largest = max(_connected_parts(grid), key=len)
    nav = NavGrid(largest)
    objects = {item.object_id: item for plan in plans for item in plan.objects}
    room = plans[0].room
    start = nav.nearest((room.x_min + room.x_max) / 2, (room.z_min + room.z_max) / 2)
    yaw = nav.freest_yaw(*start, reach=3.0)
    agent = Agent(np.array([start[0], AGENT_HEIGHT, start[1]]), yaw)
    world = World(name, objects, tuple(p.room for p in plans), nav, [agent], seed=seed)
    if doors:
        world.floor = nav
        update_floor(world)
    for plan in plans:
        _scatter(world, plan)
    world.keep_templates()
    return world


def _is_thin_picture(item: SimObject) -> bool:
    """Return whether an object is on a wall and within the margin around the agent."""
    return item.type.faces_room and float(item.front_size[2]) <= _BODY - AGENT_RADIUS


def _connected_parts(grid: NavGrid) -> list[list[tuple[float, float]]]:
    left = set(grid)
    parts = []
    while left:
        parts.append(grid.reachable_cells(*min(left)))
        left -= {min(left), *parts[-1]}
    return parts


def _scatter(world: World, plan: RoomPlan) -> None:
    """Put the plan's loose objects into or onto furniture at random; towels on holders first."""
    homes = [
        (o, o.type.capacity)
        for o in plan.objects
        if o.type.receptacle and o.type.capacity is not None
    ]
    for object_type in plan.loose:
        item = default_object(object_type, np.zeros(3))
        item.style = int(plan.random.integers(1000))
        fitting = [(o, stock) for o, stock in homes if allowed_in(object_type, o.object_type)]
        holders = [(o, stock) for o, stock in fitting if o.object_type.endswith("Holder")]
        order = [*holders, *(fitting[i] for i in plan.random.permutation(len(fitting)))]
        for home, stock in order:
            if len(home.contents) >= stock:
                continue
            tried = find_place(world, item, home, random=plan.random)
            if tried is None:
                continue
            # A new object at that place, as its id names its position. Two at the same rounded one
            # would share an id.
            placed = default_object(
                object_type, np.round(tried.position, 4), float(tried.rotation[1])
            )
            placed.style = item.style
            if placed.object_id not in world.objects:
                world.add(placed)
                world.attach(placed, home)
                break


def name_after(outer: SimObject, basin: SimObject) -> None:
    """Give a basin the id and name that AI2-THOR derives from those of its sink or tub."""
    basin.object_id = f"{outer.object_id}|{basin.object_type}"
    basin.name = f"{basin.object_type}_{outer.name.split('_')[1]}"


def rim_pieces(outer: SimObject, inner: SimObject) -> tuple[Rect, ...]:
    """Return the outline of `outer` from above without that of `inner`; both have the same yaw."""
    middle = outer.matrix.T @ (inner.center - outer.center)
    whole = outer.box_size / 2
    hole = inner.box_size / 2
    return subtract(
        (-float(whole[0]), -float(whole[2]), float(whole[0]), float(whole[2])),
        [(middle[0] - hole[0], middle[2] - hole[2], middle[0] + hole[0], middle[2] + hole[2])],
    )
