"""Distances as the published script has them: lengths of paths that it finds, up to a wall.

The search is networkx's A* on a graph of cells and directions, with a heuristic that overestimates
turns. So a path need not be a shortest one, which one is found hangs on the order of nodes and
edges and on sums in single precision, and paths that were found answer for each of their nodes. All
of it is kept, as the published rewards follow from it.
"""

from collections.abc import Iterable
from itertools import pairwise

import networkx as nx
import numpy as np

# Cell (x, z) of 0.25 m, quarter turn, degrees of the camera downwards.
Pose = tuple[int, int, int, int]
_Node = tuple[int, int, int]
_MARGIN = 30  # cells around the reachable ones
# costs of entering a cell; those of turns are 1
_FREE = np.float32(1 + 1e-4)
_WALL = np.float32(1e5)
_IMPASSABLE = 10.0
_LOOK_DEGREES = 30
_AHEAD = ((0, 1), (1, 0), (0, -1), (-1, 0))  # by quarter turn


class OffGridError(ValueError):
    """A pose is not on the graph, or has no quarter turn: the published search's assertion."""


class PublishedGraph:
    """The graph of a room: its reachable cells, and walls around them."""

    def __init__(self, cells: Iterable[tuple[int, int]]) -> None:
        """Build the graph of some cells (x, z) of 0.25 m, of which there is at least one."""
        reachable = set(cells)
        # The coordinates are numpy's, as with them sums of costs and distances are rounded
        # otherwise.
        points = np.array(sorted(reachable), dtype=np.int32)
        x_min, z_min = points.min(axis=0) - _MARGIN
        x_max, z_max = points.max(axis=0) + _MARGIN
        self.graph = nx.DiGraph()
        for z in np.arange(z_min, z_max + 1):
            for x in np.arange(x_min, x_max + 1):
                weight = _FREE if (int(x), int(z)) in reachable else _WALL
                for turn, (dx, dz) in enumerate(_AHEAD):
                    self.graph.add_edge((x, z, turn), (x, z, (turn + 1) % 4), weight=1)
                    self.graph.add_edge((x, z, turn), (x, z, (turn - 1) % 4), weight=1)
                    back = (turn + 2) % 4
                    if x_min <= x + dx <= x_max and z_min <= z + dz <= z_max:
                        self.graph.add_edge((x + dx, z + dz, back), (x, z, back), weight=weight)

    def search(self, start: _Node, goal: _Node) -> list[_Node]:
        """Return the path that the search finds, walls included."""
        path: list[_Node] = nx.astar_path(
            self.graph, start, goal, heuristic=_estimate, weight="weight"
        )
        return path

    def n_passable(self, path: list[_Node]) -> int:
        """Return the number of a path's steps before the first that enters a wall."""
        weights = (self.graph[one][other]["weight"] for one, other in pairwise(path))
        walls = (number for number, weight in enumerate(weights) if weight >= _IMPASSABLE)
        return next(walls, len(path) - 1)


def _estimate(node: _Node, goal: _Node) -> int:
    return abs(node[0] - goal[0]) + abs(node[1] - goal[1]) + abs(node[2] - goal[2])


class PublishedPaths:
    """Paths that were found in a graph so far: a search answers for all nodes of its path."""

    def __init__(
        self, graph: PublishedGraph, known: dict[tuple[_Node, _Node], list[_Node]] | None = None
    ) -> None:
        self._graph = graph
        self._known = dict(known or {})

    def copy(self) -> "PublishedPaths":
        """Return paths that go on from here on their own."""
        return PublishedPaths(self._graph, self._known)

    def n_actions(self, pose: Pose, goal: Pose) -> int:
        """Return the number of actions of the path from a pose to another; raises OffGridError.

        It ends at the first wall, wherever the goal is. Looks count if the angles differ by a
        multiple of 30 degrees.
        """
        start = pose[:3]
        end = goal[:3]
        for node in (start, end):
            if node not in self._graph.graph:
                raise OffGridError(f"{node} is not on the grid")
        if (start, end) not in self._known:
            path = self._graph.search(start, end)
            self._known |= {(node, end): path[number:] for number, node in enumerate(path)}
        angle = abs(pose[3] - goal[3])
        looks = 0 if angle % _LOOK_DEGREES else angle // _LOOK_DEGREES
        return self._graph.n_passable(self._known[start, end]) + looks
