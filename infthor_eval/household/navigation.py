"""Walking on the grid of reachable positions: shortest action sequences between poses."""

from collections import deque
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass

__all__ = ["GRID", "Cell", "Grid", "GridPose"]

GRID = 0.25  # metres
Cell = tuple[int, int]  # (x, z) in grid units
_AHEAD: dict[int, Cell] = {0: (0, 1), 90: (1, 0), 180: (0, -1), 270: (-1, 0)}


@dataclass(frozen=True, order=True)
class GridPose:
    """Where the agent stands and which way it faces (0, 90, 180 or 270 degrees)."""

    cell: Cell
    facing: int

    @property
    def ahead(self) -> Cell:
        """The next cell that way."""
        dx, dz = _AHEAD[self.facing]
        return self.cell[0] + dx, self.cell[1] + dz


class Grid:
    """The cells that the agent can reach."""

    def __init__(self, positions: Iterable[tuple[float, float]]) -> None:
        """Take positions (x, z) in metres; they lie on a grid of 0.25 m, whose offset is that of the
        first."""
        points = sorted(positions)
        self._origin = (points[0][0] % GRID, points[0][1] % GRID) if points else (0.0, 0.0)
        self.cells = frozenset(self.cell(x, z) for x, z in points)
        self._to: dict[GridPose, dict[GridPose, int]] = {}

    def cell(self, x: float, z: float) -> Cell:
        """The cell nearest to a position in metres."""
        return round((x - self._origin[0]) / GRID), round((z - self._origin[1]) / GRID)

    def position(self, cell: Cell) -> tuple[float, float]:
        """The (x, z) position of a cell, metres."""
        return cell[0] * GRID + self._origin[0], cell[1] * GRID + self._origin[1]

    def without_cell(self, cell: Cell) -> "Grid":
        """The same grid, one cell less."""
        return Grid(self.position(other) for other in self.cells if other != cell)

    def with_positions(self, positions: Iterable[tuple[float, float]]) -> "Grid":
        """The same grid with the cells of more positions, (x, z) in metres."""
        return Grid([*map(self.position, self.cells), *positions])

    def distances(self, start: GridPose) -> dict[GridPose, int]:
        """Number of actions from a stand to every stand that can be reached."""
        return {stand: length for stand, (length, _) in self._search(start, None).items()}

    def distances_to(self, goal: GridPose) -> Mapping[GridPose, int]:
        """Number of actions to a stand from every stand that it can be reached from; searched for once.

        The goal's own cell counts as reachable, whether the grid has it or not. Cells beside the grid are among the
        starts, as with `path`: one can step from there onto it.
        """
        if goal not in self._to:
            self._to[goal] = self._search_back(goal)
        return self._to[goal]

    def path(self, start: GridPose, goal: GridPose) -> list[str] | None:
        """The shortest sequence of MoveAhead, RotateLeft, RotateRight; None where there is none."""
        found = self._search(start, goal)
        if goal not in found:
            return None
        actions: list[str] = []
        stand = goal
        while (step := found[stand][1]) is not None:
            actions.append(step[0])
            stand = step[1]
        return actions[::-1]

    def _search(
        self, start: GridPose, goal: GridPose | None
    ) -> dict[GridPose, tuple[int, tuple[str, GridPose] | None]]:
        """Breadth first: stand to its distance and the action and stand that led to it."""
        found: dict[GridPose, tuple[int, tuple[str, GridPose] | None]] = {start: (0, None)}
        queue = deque([start])
        while queue:
            stand = queue.popleft()
            if stand == goal:
                break
            length = found[stand][0]
            for action, following in self._moves(stand):
                if following not in found:
                    found[following] = (length + 1, (action, stand))
                    queue.append(following)
        return found

    def _search_back(self, goal: GridPose) -> dict[GridPose, int]:
        cells = self.cells | {goal.cell}
        found = {goal: 0}
        queue = deque([goal])
        while queue:
            stand = queue.popleft()
            for previous in _stands_before(stand, cells):
                if previous not in found:
                    found[previous] = found[stand] + 1
                    queue.append(previous)
        return found

    def _moves(self, stand: GridPose) -> list[tuple[str, GridPose]]:
        facing = stand.facing
        moves = [
            ("RotateLeft", GridPose(stand.cell, (facing - 90) % 360)),
            ("RotateRight", GridPose(stand.cell, (facing + 90) % 360)),
        ]
        if stand.ahead in self.cells:
            moves.insert(0, ("MoveAhead", GridPose(stand.ahead, facing)))
        return moves


def _stands_before(stand: GridPose, cells: Container[Cell]) -> list[GridPose]:
    """The stands from which one action leads to a stand."""
    before = [GridPose(stand.cell, (stand.facing + turn) % 360) for turn in (-90, 90)]
    if stand.cell in cells:
        dx, dz = _AHEAD[stand.facing]
        before.append(GridPose((stand.cell[0] - dx, stand.cell[1] - dz), stand.facing))
    return before
