"""What a run will take, before it begins: a few of its units are done, and the rest is reckoned from them.

The first unit of a group pays for what the group shares (a trajectory that is encoded or gone through), the others
for themselves. So a group of n units that look at f frames is taken to cost

    f * (what a first unit takes beyond a later one, per frame measured) + n * (what a later unit takes)

of each quantity: seconds, requests, tokens, money.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

from infthor_eval.runs.binding import bind_run
from infthor_eval.runs.groups import group_records
from infthor_eval.runs.records import Unit, UnitRecord
from infthor_eval.runs.request import RunRequest, prepare
from infthor_eval.runs.suite import BoundEvaluation, Group, Suite, Workload
from infthor_eval.runs.usage import NOTHING, Usage

__all__ = ["Estimate", "Quantities", "TaskEstimate", "estimate_run", "estimated"]

A = TypeVar("A")
P = TypeVar("P")
U = TypeVar("U", bound=Unit[Any])

_UNITS_OF_A_GROUP = 3  # that are measured: the first, one amid it, the last


@dataclass(frozen=True)
class Quantities:
    """What some units take.

    Attributes:
        seconds: of one worker.
        requests: to the model.
        read: tokens of the requests, frames included.
        encoded: those of them that are not found in a cache.
        written: tokens of the replies.
        cost: in US dollars, by the prices that the model was given.
    """

    seconds: float = 0.0
    requests: float = 0.0
    read: float = 0.0
    encoded: float = 0.0
    written: float = 0.0
    cost: float = 0.0

    @classmethod
    def of(cls, record: UnitRecord[Any], seconds: float) -> "Quantities":
        """What a unit took."""
        usage: Usage = record.usage
        encoded = usage.context - usage.cached
        return cls(seconds, usage.requests, usage.context, encoded, usage.reply, usage.cost or 0.0)

    def plus(self, other: "Quantities", times: float = 1.0) -> "Quantities":
        """This and so many times the other."""
        return Quantities(*(getattr(self, f.name) + times * getattr(other, f.name) for f in fields(self)))

    def beyond(self, other: "Quantities") -> "Quantities":
        """By how much it is more; never less than nothing."""
        return Quantities(*(max(0.0, getattr(self, f.name) - getattr(other, f.name)) for f in fields(self)))


@dataclass(frozen=True)
class _Measured:
    """Units of one group that were done.

    Attributes:
        frames: that the group looks at.
        took: task, and what the unit took, in the order in which they were done.
        failures: task, and why a unit of it failed.
    """

    frames: int
    took: Sequence[tuple[str, Quantities]]
    failures: Sequence[tuple[str, str]] = ()


@dataclass(frozen=True)
class TaskEstimate:
    """What one task takes.

    Attributes:
        task: which.
        n_units: how many units it has.
        n_measured: how many of them were done to tell.
        frames: that its units look at, each once for a group.
        total: of all units.
    """

    task: str
    n_units: int
    n_measured: int
    frames: int
    total: Quantities


@dataclass(frozen=True)
class Estimate:
    """What a run takes.

    Attributes:
        workload: all that there is to do.
        tasks: what each of them takes; none where all units that were measured failed.
        failures: task, and why a unit of it that was measured failed.
    """

    workload: Workload
    tasks: Sequence[TaskEstimate]
    failures: Sequence[tuple[str, str]]


class _MeasuringSession:
    """A `Session` without records, as every unit is to be measured; artifacts are cached in memory."""

    def __init__(self) -> None:
        self._artifacts: dict[str, Any] = {}

    def find_record(self, unit: Unit[Any], fingerprint: str) -> None:
        """Return None: there are no records."""

    def find_artifact(self, fingerprint: str, kind: type[A]) -> A | None:
        """See `Session`."""
        return self._artifacts.get(fingerprint)

    def cache_artifact(self, fingerprint: str, artifact: Any, usage: Usage = NOTHING) -> None:
        """See `Session`."""
        self._artifacts[fingerprint] = artifact


def estimate_run(request: RunRequest, suite: Suite[U, P], n_units: int, progress: Callable[[], None]) -> Estimate:
    """Load the subject, do a few units of each task, and reckon what all of them take; nothing is written.

    Args:
        request: the run.
        suite: its suite.
        n_units: of each task, about.
        progress: is called after each group that was measured.

    Raises:
        UsageError: as `execute`.
        DataError: as `execute`.
        ModelError: as `execute`.
    """
    with closing(bind_run(prepare(request, suite))) as bound:
        workload = bound.evaluation.workload
        done = []
        for item in _measured(bound.evaluation, n_units):
            done.append(item)
            progress()
    failures = [failure for item in done for failure in item.failures]
    return Estimate(workload, estimated(workload, done) if any(item.took for item in done) else (), failures)


def _measured(evaluation: BoundEvaluation[U, P], n_units: int) -> Iterator[_Measured]:
    """Do a few units of each task: of groups of all sizes, of each the first, one amid it and the last."""
    session = _MeasuringSession()
    for group in _chosen(evaluation.workload.groups, max(1, round(n_units / _UNITS_OF_A_GROUP))):
        units = list(group.units)
        part = list(dict.fromkeys((0, len(units) // 2, len(units) - 1)))
        took, failures = [], []
        few = replace(group, units=[units[n] for n in part])
        began = time.perf_counter()
        for record in group_records(evaluation, few, session):
            now = time.perf_counter()
            if record.failure is None:
                took.append((record.task, Quantities.of(record, now - began)))
            else:
                failures.append((record.task, record.failure))
            began = now
        yield _Measured(group.frames, took, failures)


def _chosen(groups: Sequence[Group[U]], n: int) -> Iterator[Group[U]]:
    """So many groups of each task, evenly from the smallest to the largest."""
    by_task: dict[str, list[Group[U]]] = {}
    for group in groups:
        by_task.setdefault(group.units[0].key.task, []).append(group)
    for same in by_task.values():
        ordered = sorted(same, key=lambda group: (group.frames, len(group.units)))
        n_taken = min(n, len(ordered))
        yield from (ordered[(2 * k + 1) * len(ordered) // (2 * n_taken)] for k in range(n_taken))


def estimated(workload: Workload, done: Sequence[_Measured]) -> list[TaskEstimate]:
    """What each task will take.

    Args:
        workload: all that there is to do.
        done: units of it; at least one that has not failed.
    """
    later = _later(done)
    opening = _opening(done, later)
    found = []
    for task in dict.fromkeys(unit.key.task for group in workload.groups for unit in group.units):
        shares = [(group, sum(unit.key.task == task for unit in group.units)) for group in workload.groups]
        total, n_units, frames = Quantities(), 0, 0
        for group, n in shares:
            share = n / len(group.units)  # of a group of several tasks
            total = total.plus(opening(group), group.frames * share).plus(later.get(task, later[""]), n)
            n_units, frames = n_units + n, frames + round(group.frames * share)
        n_measured = sum(name == task for item in done for name, _ in item.took)
        found.append(TaskEstimate(task, n_units, n_measured, frames, total))
    return found


def _later(done: Sequence[_Measured]) -> Mapping[str, Quantities]:
    """What a unit that is not the first of its group takes, by task; under "" of all tasks."""
    kept: dict[str, list[Quantities]] = {}
    for item in done:
        for task, took in item.took[1:] or item.took:
            kept.setdefault(task, []).append(took)
            kept.setdefault("", []).append(took)
    return {task: _mean(same) for task, same in kept.items()}


def _opening(done: Sequence[_Measured], later: Mapping[str, Quantities]) -> Callable[[Group], Quantities]:
    """What the first unit of a group takes beyond a later one for each frame, in groups of the same task."""
    totals: dict[str, Quantities] = {}
    frames: Counter[str] = Counter()
    for item in done:
        if len(item.took) > 1:
            task, first = item.took[0]
            totals[task] = totals.get(task, Quantities()).plus(first.beyond(later[task]))
            frames[task] += item.frames

    def of(group: Group) -> Quantities:
        task = next((unit.key.task for unit in group.units if unit.key.task in totals), None)
        return Quantities() if task is None else Quantities().plus(totals[task], 1 / frames[task])

    return of


def _mean(same: Sequence[Quantities]) -> Quantities:
    total = Quantities()
    for took in same:
        total = total.plus(took, 1 / len(same))
    return total
