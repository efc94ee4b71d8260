"""Where the agent can stand: cells of 0.25 m, from recordings or from the free floor of a procedural room."""

import math
from collections import deque
from collections.abc import Iterable, Iterator

import numpy as np

from infthor_eval.sim.geometry import Array

__all__ = ["CELL", "NavGrid"]

CELL = 0.25
_SAME = 1e-3
_TOLERANCE = 0.06  # a recorded position lies this near to its cell's centre (float noise of the recordings)


class NavGrid:
    """A set of cells, keyed by rounded multiples of `CELL` from the set's own offset.

    Args:
        points: (x, z) positions in metres where the agent can stand.
    """

    def __init__(self, points: Iterable[tuple[float, float]]) -> None:
        listed = [(float(x), float(z)) for x, z in points]
        first = listed[0] if listed else (0.0, 0.0)
        self._offset = (_phase(first[0]), _phase(first[1]))
        self._cells = {self._key(x, z): (x, z) for x, z in sorted(listed)}

    def __len__(self) -> int:
        return len(self._cells)

    def __iter__(self) -> Iterator[tuple[float, float]]:
        return iter(self._cells.values())

    def stands(self, x: float, z: float) -> bool:
        """Whether the agent can stand at (x, z): the nearest cell is one of the set and near enough."""
        cell = self._cells.get(self._key(x, z))
        return cell is not None and max(abs(cell[0] - x), abs(cell[1] - z)) <= CELL / 2 + _TOLERANCE

    def nearest(self, x: float, z: float) -> tuple[float, float]:
        """The cell nearest to (x, z)."""
        return min(self._cells.values(), key=lambda cell: ((cell[0] - x) ** 2 + (cell[1] - z) ** 2, cell))

    def walk(self, start: tuple[float, float], end: tuple[float, float]) -> bool:
        """Whether every point of the straight way from `start` to `end` can be stood at (sampled each 0.1 m)."""
        steps = max(1, math.ceil(math.dist(start, end) / 0.1))
        return all(
            self.stands(start[0] + (end[0] - start[0]) * i / steps, start[1] + (end[1] - start[1]) * i / steps)
            for i in range(1, steps + 1)
        )

    def reachable(self, x: float, z: float) -> list[tuple[float, float]]:
        """Cells connected to the one at (x, z) by steps of one cell, sorted."""
        return sorted(self._cells[key] for key in self._distances(x, z))

    def lattice(self, x: float, z: float, size: float, yaw: float) -> list[tuple[float, float]]:
        """Points that can be reached from (x, z) by steps of `size` metres along the axes turned by `yaw` degrees.

        Sorted; steps of one cell along the axes from a cell are those of `reachable`.
        """
        start = self._cells.get(self._key(x, z))
        if size == CELL and yaw % 90 == 0 and start is not None and math.dist(start, (x, z)) < _SAME:
            return self.reachable(x, z)
        ahead = (math.sin(math.radians(yaw)) * size, math.cos(math.radians(yaw)) * size)
        known = {(0, 0): (x, z)}
        queue = deque(known)
        while queue:
            key = queue.popleft()
            for other in _neighbours(key):
                point = (x + other[0] * ahead[1] + other[1] * ahead[0], z - other[0] * ahead[0] + other[1] * ahead[1])
                if other not in known and self.walk(known[key], point):
                    known[other] = point
                    queue.append(other)
        return sorted((round(px, 6), round(pz, 6)) for px, pz in known.values())

    def path(self, start: tuple[float, float], end: tuple[float, float]) -> list[tuple[float, float]] | None:
        """A shortest path of cells from `start` to the cell of `end`, or None."""
        distances = self._distances(*end)
        key = self._key(*start)
        if key not in distances:
            return None
        cells = [key]
        while distances[key]:
            key = min(k for k in _neighbours(key) if distances.get(k) == distances[key] - 1)
            cells.append(key)
        return [self._cells[k] for k in cells]

    def freedom(self, x: float, z: float, yaw: float, reach: float = 1.25) -> int:
        """Number of cells within `reach` metres in front of (x, z), in the quarter that `yaw` looks into."""
        if not self._cells:
            return 0
        cells: Array = np.array(list(self._cells.values()))
        offset = cells - (x, z)
        angle = math.radians(yaw)
        ahead = offset @ (math.sin(angle), math.cos(angle))
        aside = np.abs(offset @ (math.cos(angle), -math.sin(angle)))
        return int(np.sum((ahead > 0.05) & (ahead <= reach) & (aside <= 0.3 + ahead * 0.4)))

    def freest_yaw(self, x: float, z: float, reach: float = 1.25) -> float:
        """The quarter turn (degrees) that looks from (x, z) at the most cells; see `freedom`."""
        return max((0.0, 90.0, 180.0, 270.0), key=lambda yaw: self.freedom(x, z, yaw, reach))

    def _key(self, x: float, z: float) -> tuple[int, int]:
        return round((x - self._offset[0]) / CELL), round((z - self._offset[1]) / CELL)

    def _distances(self, x: float, z: float) -> dict[tuple[int, int], int]:
        start = self._key(x, z)
        distances = {start: 0} if start in self._cells else {}
        queue = deque(distances)
        while queue:
            key = queue.popleft()
            for other in _neighbours(key):
                if other in self._cells and other not in distances:
                    distances[other] = distances[key] + 1
                    queue.append(other)
        return distances


def _neighbours(key: tuple[int, int]) -> list[tuple[int, int]]:
    return [(key[0] + 1, key[1]), (key[0] - 1, key[1]), (key[0], key[1] + 1), (key[0], key[1] - 1)]


def _phase(value: float) -> float:
    return value - round(value / CELL) * CELL
