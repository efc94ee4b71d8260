"""Which task comes next: sampled so that types, objects and receptacles stay diverse, from what the room can
do."""

import random
from collections import Counter
from collections.abc import Iterable, Iterator

from infthor_eval.household.possible_tasks import tasks_of
from infthor_eval.household.symbolic import Room
from infthor_eval.household.tasks import Task, TaskType

__all__ = ["TaskPool"]

_DOUBTED = 3  # failures that count: rooms change, and tasks that never failed must not crowd out the others


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
        self._used: Counter[str] = Counter()
        self._failed: Counter[Task] = Counter()

    def sample(self, room: Room, extra_types: Iterable[str] = ()) -> Iterator[Task]:
        """Tasks for a room as it is now, in random order, the fresher ones earlier.

        Args:
            room: as it is now.
            extra_types: types of what the room has beside items and places (faucets).
        """
        found = [task for task in tasks_of(room, extra_types) if task.task_type in self._task_types]
        # Efraimidis and Spirakis: sorting by u ** (1 / weight) is weighted sampling without replacement. In its
        # logarithm, as the power itself is 0 for all tasks alike once weights are small.
        share = Counter(task.task_type for task in found)
        waits = {task: self._rng.expovariate(self._weight(task) / share[task.task_type]) for task in found}
        yield from sorted(found, key=lambda task: waits[task])

    def used(self, task: Task) -> None:
        """Note that a task became part of the trajectory."""
        self._used.update(_aspects(task))

    def failed(self, task: Task) -> None:
        """Note that a task was tried and did not work."""
        self._failed[task] += 1

    def _weight(self, task: Task) -> float:
        weight = 0.5 ** min(self._failed[task], _DOUBTED)
        for aspect in _aspects(task):
            weight /= 1 + self._used[aspect]
        return weight


def _aspects(task: Task) -> list[str]:
    """What of a task shall not recur too often."""
    receptacle = task.receptacle or task.light
    return [f"type {task.task_type} {task.sliced}", f"pickup {task.pickup}", f"to {receptacle}", str(task)]
