"""Cells that recordings leave out because an open door or drawer would be there."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from infthor_sim.agent import AGENT_HEIGHT
from infthor_sim.geometry import Array, level_gaps
from infthor_sim.objects import SimObject
from infthor_sim.physics.navigation import CELL, NavGrid
from infthor_sim.physics.obstacles import door_leaf
from infthor_sim.world import World

_RADIUS = 0.2  # of the agent's capsule, metres
_OPENNESS = (0.25, 0.5, 0.75, 1.0)
_KNEE = 0.1  # metres above the floor below which nothing stops the agent


def add_door_cells(world: World) -> None:
    """Add the cells beside the grid that only a door or drawer, closed now, could block.

    ALFRED's layouts have no such cells, but AI2-THOR lets its agent stand there while the door is
    closed. An open door blocks them as it blocks others, see `obstacles`.
    """
    points = np.array(sorted(set(_fringe(world.nav)))).reshape(-1, 2)
    free = points[_in_reach_of_a_door(world, points) & _clear(world, points)]
    world.nav = NavGrid([*world.nav, *((float(x), float(z)) for x, z in free)])


def _fringe(nav: NavGrid) -> Iterator[tuple[float, float]]:
    """Yield the points one or two steps off the grid, with repetitions."""
    for x, z in nav:
        for i in (-2, -1, 0, 1, 2):
            for j in (-2, -1, 0, 1, 2):
                point = (round(x + i * CELL, 4), round(z + j * CELL, 4))
                if abs(i) + abs(j) in (1, 2) and not nav.can_stand(*point):
                    yield point


def _in_reach_of_a_door(world: World, points: Array) -> NDArray[np.bool_]:
    """Return at which points (n, 2) the agent would touch a door or drawer that opens wide."""
    reached = np.zeros(len(points), dtype=bool)
    for item in world.objects.values():
        if item.state.openness == 0 and (item.type.hinged or item.type.slides):
            for leaf in _leaves(item):
                reached |= level_gaps(points, *leaf) < _RADIUS
    return reached


def _leaves(item: SimObject) -> Iterator[tuple[Array, Array]]:
    """Yield the corners of boxes around an object's door or drawer as it opens wide."""
    opened = item.duplicate(item.object_id)
    for opened.state.openness in _OPENNESS:
        leaf = door_leaf(opened)
        if leaf is not None:
            yield leaf


def _clear(world: World, points: Array) -> NDArray[np.bool_]:
    """Return at which points (n, 2) the agent's capsule touches neither object nor wall."""
    low, high = np.array(world.scene_bounds())[:, [0, 2]]
    floor = world.standing_height - AGENT_HEIGHT
    clear = np.minimum(points - low, high - points).min(axis=1, initial=np.inf) >= _RADIUS
    for item in world.objects.values():
        bottom, top = item.bounds()
        in_height = top[1] > floor + _KNEE and bottom[1] < floor + 2 * AGENT_HEIGHT
        if in_height and item.object_type != "Floor":
            clear &= level_gaps(points, bottom, top) >= _RADIUS
    return np.asarray(clear)
