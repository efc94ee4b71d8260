"""Which task comes next: sampled so that types, objects and receptacles stay diverse, from what the room can do.

A task is drawn variable by variable - its type, then the object, what carries it, and where it goes, each given those
before it. A value that was used n times is weighed by 1 / (1 + n), once for its uses with the values drawn before it
(conditionally) and once for all its uses (as a prior), with some noise on it, as published.
"""

import random
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from infthor_eval.household.possible_tasks import tasks_of
from infthor_eval.household.symbolic import SymbolicRoom
from infthor_eval.household.tasks import Task, TaskType

__all__ = ["TaskPool"]

_DOUBTED = 3  # failures that count: rooms change, and tasks that never failed must not crowd out the others
_NOISE = 0.1  # by how much of itself a weight may be off
_N_VARIABLES = 4


class TaskPool:
    """Samples tasks; what was used or failed becomes less likely."""

    def __init__(self, task_types: Iterable[TaskType], rng: random.Random) -> None:
        """Begin with nothing used.

        Args:
            task_types: what to draw from.
            rng: makes the choices.
        """
        self._task_types = frozenset(task_types)
        self._rng = rng
        self._alone: Counter[tuple[int, str]] = Counter()
        self._together: Counter[tuple[str, ...]] = Counter()
        self._failed: Counter[Task] = Counter()

    def sample(self, room: SymbolicRoom, extra_types: Iterable[str] = ()) -> Iterator[Task]:
        """Tasks for a room as it is now, in random order, the fresher ones earlier.

        Args:
            room: as it is now.
            extra_types: types of what the room has beside items and places (faucets).
        """
        found = [task for task in tasks_of(room, extra_types) if task.task_type in self._task_types]
        # Efraimidis and Spirakis: sorting by exponential waits is weighted sampling without replacement.
        waits = {task: self._rng.expovariate(chance) for task, chance in self._chances(found)}
        yield from sorted(found, key=lambda task: waits[task])

    def note_use(self, task: Task) -> None:
        """Note that a task became part of the trajectory."""
        values = _values(task)
        self._alone.update(enumerate(values))
        self._together.update(values[:length] for length in range(1, len(values) + 1))

    def note_failure(self, task: Task) -> None:
        """Note that a task was tried and did not work."""
        self._failed[task] += 1

    def _chances(self, tasks: Sequence[Task], drawn: int = 0, chance: float = 1.0) -> Iterator[tuple[Task, float]]:
        """Every task with how likely it is to be drawn; the first `drawn` variables of these are alike."""
        if drawn == _N_VARIABLES:
            yield from ((task, chance * 0.5 ** min(self._failed[task], _DOUBTED)) for task in tasks)
            return
        groups: dict[tuple[str, ...], list[Task]] = {}
        for task in tasks:
            groups.setdefault(_values(task)[: drawn + 1], []).append(task)
        weights = {values: self._weight(values) for values in groups}
        total = sum(weights.values())
        for values, group in groups.items():
            yield from self._chances(group, drawn + 1, chance * weights[values] / total)

    def _weight(self, values: tuple[str, ...]) -> float:
        """Of the last of these values, given those before it."""
        prior = 1 / (1 + self._alone[len(values) - 1, values[-1]])
        conditional = 1 / (1 + self._together[values]) if len(values) > 1 else 1.0
        return prior * conditional * self._rng.uniform(1 - _NOISE, 1 + _NOISE)


def _values(task: Task) -> tuple[str, ...]:
    """The variables of a task in the order in which they are drawn."""
    return str(task.task_type), task.target, task.movable or "", task.receptacle or task.light or ""
