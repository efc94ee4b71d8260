"""Sampling the next task, as the published generator does when it runs.

A task is a tuple of a goal, the object, the movable receptacle, and the receptacle or lamp. Each
value of each variable gets the weight 1 / (1 + n), n drawn from 0 to 10. (The published weights
also have counts of uses, which stay 0 as it runs.) The value that leads the others of its variable
by most is taken, and the same is repeated with the tuples that have it. A tuple that was drawn is
not drawn again, whether it was accepted or not.
"""

import random
from collections.abc import Collection, Iterable, Sequence

from infthor_eval.household.tasks import Task

_NOISE = 10  # largest n of a weight (`inject_noise`)
_N_VARIABLES = 4


class TaskPool:
    """Draws tasks, each at most once until the pool begins again."""

    def __init__(self, rng: random.Random) -> None:
        """Start with no task drawn; `rng` is the source of all random choices."""
        self._rng = rng
        self._drawn: set[Task] = set()

    def draw(self, candidates: Iterable[Task]) -> Task | None:
        """Return one of some tasks that was not drawn before; None if all of them were."""
        tasks = [task for task in candidates if task not in self._drawn]
        if not tasks:
            return None
        while len(tasks) > 1:
            tasks = self._narrow(tasks)
        self._drawn.add(tasks[0])
        return tasks[0]

    def begin_again(self, candidates: Collection[Task]) -> bool:
        """Let all tasks be drawn again; returns False if none of `candidates` was drawn."""
        if self._drawn.isdisjoint(candidates):
            return False
        self._drawn.clear()
        return True

    def _narrow(self, tasks: Sequence[Task]) -> list[Task]:
        """Return the tasks, fewer than before (at least two), with the value that leads by most."""
        variable, value = max(self._leads(tasks))[2:]
        return [task for task in tasks if _values(task)[variable] == value]

    def _leads(self, tasks: Sequence[Task]) -> list[tuple[float, float, int, str]]:
        """Return each value's lead over its variable's last, a tie-breaker, variable and value."""
        leads = []
        for variable in range(_N_VARIABLES):
            values = sorted({_values(task)[variable] for task in tasks} - {""})
            if len(values) > 1:
                weights = [1 / (1 + self._rng.randint(0, _NOISE)) for _ in values]
                for value, weight in zip(values, weights, strict=True):
                    lead = round((weight - min(weights)) / sum(weights), 9)
                    leads.append((lead, self._rng.random(), variable, value))
        return leads


def _values(task: Task) -> tuple[str, str, str, str]:
    """Return the variables of a task, as published: slices are objects; "" for none."""
    return str(task.task_type), task.target, task.movable or "", task.receptacle or task.light or ""
