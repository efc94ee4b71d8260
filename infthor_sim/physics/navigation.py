"""The cells of 0.25 m that the agent can stand on, recorded or a procedural room's free floor."""

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from infthor_sim.geometry import Array

CELL = 0.25  # metres
_SAME = 1e-3  # metres between two positions that count as one
# metres that a recorded position may be off its cell's centre, by rounding in the recordings
_TOLERANCE = 0.06
# metres from a cell's centre at which AI2-THOR still starts its agents, where nothing known is in
# their way; the next cell, at 0.25, it refused
_BESIDE = 0.23


class Stop(NamedTuple):
    """A place (x, z) on a walk, and the stop before it."""

    place: tuple[float, float]
    before: "Stop | None" = None

    def way(self) -> list[tuple[float, float]]:
        """Return the places from the walk's start to here."""
        places = [self.place]
        stop = self
        while stop.before is not None:
            stop = stop.before
            places.append(stop.place)
        return places[::-1]


class NavGrid:
    """The cells of one scene.

    Args:
        points: (x, z) positions in metres where the agent can stand; whole cells apart.
        is_free: whether the agent touches nothing at (x, z), which then decides beside the cells;
            None: there is no floor beside them.
    """

    def __init__(
        self,
        points: Iterable[tuple[float, float]],
        is_free: Callable[[float, float], bool] | None = None,
    ) -> None:
        # Keys are whole multiples of `CELL` from the first point's own offset: a recording's grid
        # need not pass through the origin.
        listed = [(float(x), float(z)) for x, z in points]
        first = listed[0] if listed else (0.0, 0.0)
        self._offset = (_phase(first[0]), _phase(first[1]))
        self._cells = {self._key(x, z): (x, z) for x, z in sorted(listed)}
        self.is_free = is_free

    def __len__(self) -> int:
        return len(self._cells)

    def __iter__(self) -> Iterator[tuple[float, float]]:
        return iter(self._cells.values())

    def can_stand(self, x: float, z: float) -> bool:
        """Return whether the agent can stand at (x, z): on a cell, or on free floor beside one."""
        key = self._key(x, z)
        cell = self._cells.get(key)
        if cell is not None and max(abs(cell[0] - x), abs(cell[1] - z)) <= CELL / 2 + _TOLERANCE:
            return True
        around = ((key[0] + i, key[1] + j) for i in (-1, 0, 1) for j in (-1, 0, 1))
        return (
            self.is_free is not None
            and any(
                math.dist(self._cells[other], (x, z)) <= _BESIDE
                for other in around
                if other in self._cells
            )
            and self.is_free(x, z)
        )

    def nearest(self, x: float, z: float) -> tuple[float, float]:
        """Return the cell nearest to (x, z)."""
        # The cell itself breaks ties, so that the order of the points does not matter.
        return min(
            self._cells.values(), key=lambda cell: ((cell[0] - x) ** 2 + (cell[1] - z) ** 2, cell)
        )

    def gap(self, x: float, z: float) -> float:
        """Return metres from (x, z) to the nearest point where the agent can stand."""
        half = CELL / 2 + _TOLERANCE
        gaps = (
            math.hypot(max(abs(cell[0] - x) - half, 0.0), max(abs(cell[1] - z) - half, 0.0))
            for cell in self
        )
        return min(gaps, default=math.inf)

    def can_walk(self, start: tuple[float, float], end: tuple[float, float]) -> bool:
        """Return whether the agent can stand all along a straight way, checked each 0.1 m."""
        steps = max(1, math.ceil(math.dist(start, end) / 0.1))
        return all(
            self.can_stand(
                start[0] + (end[0] - start[0]) * i / steps,
                start[1] + (end[1] - start[1]) * i / steps,
            )
            for i in range(1, steps + 1)
        )

    def reachable_cells(self, x: float, z: float) -> list[tuple[float, float]]:
        """Return the cells connected to the one at (x, z) by steps of one cell, sorted."""
        return sorted(self._cells[key] for key in self._distances(x, z))

    def reachable_points(
        self, x: float, z: float, size: float, yaw: float
    ) -> list[tuple[float, float]]:
        """Return points reachable by steps of `size` metres along axes at `yaw`, sorted."""
        return sorted(stop.place for stop in self.walk_out((x, z), size, yaw))

    def walk_out(self, start: tuple[float, float], size: float, yaw: float = 0.0) -> Iterator[Stop]:
        """Yield all stops of walks by steps of `size` metres along axes at `yaw`, nearest first."""
        key = self._key(*start)
        cell = self._cells.get(key)
        # Steps of one cell from a cell reach cells: quicker, and the points are those of the grid
        # to the last bit.
        on_cells = size == CELL and yaw % 90 == 0 and cell and math.dist(cell, start) < _SAME
        first = Stop(cell) if cell and on_cells else Stop((round(start[0], 6), round(start[1], 6)))
        sine, cosine = math.sin(math.radians(yaw)) * size, math.cos(math.radians(yaw)) * size
        queue = deque([(key if on_cells else (0, 0), first)])  # by cells, or steps aside and ahead
        reached = {queue[0][0]}
        while queue:
            key, stop = queue.popleft()
            yield stop
            for other in _neighbours(key):
                if other in reached:
                    continue
                place = self._cells.get(other)
                if not on_cells:
                    aside, ahead = other
                    place = (
                        round(start[0] + aside * cosine + ahead * sine, 6),
                        round(start[1] - aside * sine + ahead * cosine, 6),
                    )
                if place and (on_cells or self.can_walk(stop.place, place)):
                    reached.add(other)
                    queue.append((other, Stop(place, stop)))

    def path(
        self, start: tuple[float, float], end: tuple[float, float]
    ) -> list[tuple[float, float]] | None:
        """Return a shortest path of cells from `start` to that of `end`; None if there is none."""
        distances = self._distances(*end)
        key = self._key(*start)
        if key not in distances:
            return None
        cells = [key]
        while distances[key]:
            # Of several neighbours that are one step nearer the smallest is taken: the path is
            # always the same one.
            key = min(k for k in _neighbours(key) if distances.get(k) == distances[key] - 1)
            cells.append(key)
        return [self._cells[k] for k in cells]

    def count_free_ahead(self, x: float, z: float, yaw: float, reach: float = 1.25) -> int:
        """Return the cells within `reach` metres of (x, z), in a cone to `yaw` (degrees)."""
        if not self._cells:
            return 0
        cells: Array = np.array(list(self._cells.values()))
        offset = cells - (x, z)
        angle = math.radians(yaw)
        ahead = offset @ (math.sin(angle), math.cos(angle))
        aside = np.abs(offset @ (math.cos(angle), -math.sin(angle)))
        return int(np.sum((ahead > 0.05) & (ahead <= reach) & (aside <= 0.3 + ahead * 0.4)))

    def freest_yaw(self, x: float, z: float, reach: float = 1.25) -> float:
        """Return the yaw (0, 90, 180, 270) with the most cells ahead; see `count_free_ahead`."""
        return max(
            (0.0, 90.0, 180.0, 270.0), key=lambda yaw: self.count_free_ahead(x, z, yaw, reach)
        )

    def _key(self, x: float, z: float) -> tuple[int, int]:
        return round((x - self._offset[0]) / CELL), round((z - self._offset[1]) / CELL)

    def _distances(self, x: float, z: float) -> dict[tuple[int, int], int]:
        """Return the steps to every cell that is connected to the one at (x, z), by key."""
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
    # in the order in which AI2-THOR tries them
    return [(key[0] + 1, key[1]), (key[0], key[1] + 1), (key[0] - 1, key[1]), (key[0], key[1] - 1)]


def _phase(value: float) -> float:
    """Return the offset of a grid that passes through `value` from one that passes through 0."""
    return value - round(value / CELL) * CELL
