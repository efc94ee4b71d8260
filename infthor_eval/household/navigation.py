"""Shortest action sequences between poses on the grid of reachable positions."""

from collections import deque
from collections.abc import Container, Iterable, Mapping
from functools import cache
from typing import NamedTuple

GRID = 0.25  # metres
Cell = tuple[int, int]  # (x, z) in grid units
_AHEAD: dict[int, Cell] = {0: (0, 1), 90: (1, 0), 180: (0, -1), 270: (-1, 0)}


class GridPose(NamedTuple):
    """The agent's cell and heading (0, 90, 180 or 270 degrees)."""

    cell: Cell
    facing: int

    @property
    def ahead(self) -> Cell:
        """The cell in front of the agent."""
        dx, dz = _AHEAD[self.facing]
        return self.cell[0] + dx, self.cell[1] + dz


# By pose: its distance, and the action and pose before it.
_Reached = dict[GridPose, tuple[int, tuple[str, GridPose] | None]]


class Grid:
    """The cells that the agent can reach."""

    def __init__(self, positions: Iterable[tuple[float, float]]) -> None:
        """Build the grid of positions (x, z), metres, spaced by 0.25 m; the first is its offset."""
        points = sorted(positions)
        self._origin = (points[0][0] % GRID, points[0][1] % GRID) if points else (0.0, 0.0)
        self.cells = frozenset(self.cell(x, z) for x, z in points)
        self._to: dict[GridPose, dict[GridPose, int]] = {}
        self._moves = cache(self._list_moves)
        # A way is usually asked for after the distances from the same pose.
        self._last: tuple[GridPose, _Reached] | None = None

    def cell(self, x: float, z: float) -> Cell:
        """Return the cell nearest to a position in metres."""
        return round((x - self._origin[0]) / GRID), round((z - self._origin[1]) / GRID)

    def position(self, cell: Cell) -> tuple[float, float]:
        """Return the (x, z) position of a cell, metres."""
        return cell[0] * GRID + self._origin[0], cell[1] * GRID + self._origin[1]

    def without_cell(self, cell: Cell) -> "Grid":
        """Return the grid without one cell."""
        return Grid(self.position(other) for other in self.cells if other != cell)

    def with_positions(self, positions: Iterable[tuple[float, float]]) -> "Grid":
        """Return the grid with the cells of further positions, (x, z) in metres."""
        return Grid([*map(self.position, self.cells), *positions])

    def distances(self, start: GridPose) -> dict[GridPose, int]:
        """Return the number of actions from a pose to every pose that can be reached."""
        reached = self._search(start, None)
        self._last = start, reached
        return {stand: length for stand, (length, _) in reached.items()}

    def distances_to(self, goal: GridPose) -> Mapping[GridPose, int]:
        """Return the number of actions to a pose from every pose that leads to it, from a cache.

        The goal's cell counts as reachable even if the grid lacks it. Cells beside the grid are
        possible starts, as in `path`: the agent can step from there onto the grid.
        """
        if goal not in self._to:
            self._to[goal] = self._search_back(goal)
        return self._to[goal]

    def path(self, start: GridPose, goal: GridPose) -> list[str] | None:
        """Return the shortest sequence of MoveAhead, RotateLeft and RotateRight; None if none."""
        last = self._last
        reached = last[1] if last and last[0] == start else self._search(start, goal)
        if goal not in reached:
            return None
        actions: list[str] = []
        pose = goal
        while (step := reached[pose][1]) is not None:
            actions.append(step[0])
            pose = step[1]
        return actions[::-1]

    def _search(self, start: GridPose, goal: GridPose | None) -> _Reached:
        """Search breadth-first, to a goal or everywhere."""
        reached: _Reached = {start: (0, None)}
        queue = deque([start])
        while queue:
            pose = queue.popleft()
            if pose == goal:
                break
            length = reached[pose][0]
            for action, following in self._moves(pose):
                if following not in reached:
                    reached[following] = (length + 1, (action, pose))
                    queue.append(following)
        return reached

    def _search_back(self, goal: GridPose) -> dict[GridPose, int]:
        cells = self.cells | {goal.cell}
        reached = {goal: 0}
        queue = deque([goal])
        while queue:
            pose = queue.popleft()
            for previous in _poses_before(pose, cells):
                if previous not in reached:
                    reached[previous] = reached[pose] + 1
                    queue.append(previous)
        return reached

    def _list_moves(self, pose: GridPose) -> list[tuple[str, GridPose]]:
        # MoveAhead first: the order breaks ties between paths of the same length, so it is part of
        # the generated data.
        moves = [
            ("RotateLeft", GridPose(pose.cell, (pose.facing - 90) % 360)),
            ("RotateRight", GridPose(pose.cell, (pose.facing + 90) % 360)),
        ]
        if pose.ahead in self.cells:
            moves.insert(0, ("MoveAhead", GridPose(pose.ahead, pose.facing)))
        return moves


def _poses_before(pose: GridPose, cells: Container[Cell]) -> list[GridPose]:
    """Return the poses from which one action leads to a pose."""
    before = [GridPose(pose.cell, (pose.facing + turn) % 360) for turn in (-90, 90)]
    if pose.cell in cells:
        dx, dz = _AHEAD[pose.facing]
        before.append(GridPose((pose.cell[0] - dx, pose.cell[1] - dz), pose.facing))
    return before
