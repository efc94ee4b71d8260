"""Sampling the next task among those that are possible, so that types, objects and receptacles are diverse.

A task is sampled variable by variable: its type, the object, the movable receptacle and the receptacle or lamp, each
conditioned on those before it. The weight of a value is 1 / (1 + n) for its n uses after the same values (conditional),
times 1 / (1 + n) for all its uses (prior), with noise, as in the paper.
"""

import random
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from infthor_eval.household.possible_tasks import tasks_of
from infthor_eval.household.symbolic import SymbolicRoom
from infthor_eval.household.tasks import Task, TaskType

__all__ = ["TaskPool"]

_MAX_FAILURES = 3  # further failures do not lower a weight: rooms change, and other tasks must not crowd this one out
_NOISE = 0.1  # relative noise of a weight
_N_VARIABLES = 4


class TaskPool:
    """Samples tasks; used and failed ones become less likely."""

    def __init__(self, task_types: Iterable[TaskType], rng: random.Random) -> None:
        """Start without uses; `rng` is the source of all random choices."""
        self._task_types = frozenset(task_types)
        self._rng = rng
        self._uses: Counter[tuple[int, str]] = Counter()  # of a value of the variable with this index
        self._joint_uses: Counter[tuple[str, ...]] = Counter()  # of the first values together
        self._failures: Counter[Task] = Counter()

    def sample(self, room: SymbolicRoom, extra_types: Iterable[str] = ()) -> Iterator[Task]:
        """Yield the possible tasks in weighted random order; for `extra_types` see `tasks_of`."""
        tasks = [task for task in tasks_of(room, extra_types) if task.task_type in self._task_types]
        # Sorting by exponential waiting times is weighted sampling without replacement (Efraimidis and Spirakis 2006).
        waits = {task: self._rng.expovariate(probability) for task, probability in self._probabilities(tasks)}
        yield from sorted(tasks, key=lambda task: waits[task])

    def note_use(self, task: Task) -> None:
        """Count a task that became part of the trajectory."""
        values = _values(task)
        self._uses.update(enumerate(values))
        self._joint_uses.update(values[:length] for length in range(1, len(values) + 1))

    def note_failure(self, task: Task) -> None:
        """Count a task that was tried and failed."""
        self._failures[task] += 1

    def _probabilities(
        self, tasks: Sequence[Task], n_fixed: int = 0, probability: float = 1.0
    ) -> Iterator[tuple[Task, float]]:
        """Yield the tasks with their probabilities; the first `n_fixed` variables of all of them are equal."""
        if n_fixed == _N_VARIABLES:
            yield from ((task, probability * 0.5 ** min(self._failures[task], _MAX_FAILURES)) for task in tasks)
            return
        groups: dict[tuple[str, ...], list[Task]] = {}
        for task in tasks:
            groups.setdefault(_values(task)[: n_fixed + 1], []).append(task)
        weights = {values: self._weight(values) for values in groups}
        total = sum(weights.values())
        for values, group in groups.items():
            yield from self._probabilities(group, n_fixed + 1, probability * weights[values] / total)

    def _weight(self, values: tuple[str, ...]) -> float:
        """Return the weight of the last value, given those before it."""
        prior = 1 / (1 + self._uses[len(values) - 1, values[-1]])
        conditional = 1 / (1 + self._joint_uses[values]) if len(values) > 1 else 1.0
        return prior * conditional * self._rng.uniform(1 - _NOISE, 1 + _NOISE)


def _values(task: Task) -> tuple[str, ...]:
    """Return the variables of a task in the order in which they are sampled."""
    return str(task.task_type), task.target, task.movable or "", task.receptacle or task.light or ""
