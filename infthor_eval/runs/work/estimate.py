"""Estimates of a run's time, requests, tokens and money, from a few units that are done.

The first unit of a group pays for what the group shares (encoding or replaying a trajectory), the
others only for themselves. So each quantity of a group with n units on f frames is estimated as

    f * (excess of a first unit over a later one, per measured frame) + n * (quantity of a later
    unit)

To add or change the estimate of what a run takes: here; a group's `frames` in its suite.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, fields, replace
from typing import Any

from infthor_eval.runs.journals.record_encoder import RecordEncoder
from infthor_eval.runs.journals.records import Payload, SuiteUnit, Unit, UnitRecord
from infthor_eval.runs.request import RunRequest, prepare
from infthor_eval.runs.suite import BoundEvaluation, Group, Suite, Workload
from infthor_eval.runs.usage import Usage
from infthor_eval.runs.work.binding import bind_run, group_records
from infthor_eval.runs.work.executor import UnrecordedSession

_UNITS_OF_A_GROUP = 3  # measured units of a group: the first, the middle and the last


@dataclass(frozen=True)
class Quantities:
    """Time, requests, tokens and cost of some units.

    Attributes:
        seconds: time of one worker.
        read: tokens of the requests, frames included.
        encoded: those of them that are not in a cache.
        written: tokens of the replies.
        cost: cost in US dollars, by the prices given to the model.
    """

    seconds: float = 0.0
    requests: float = 0.0
    read: float = 0.0
    encoded: float = 0.0
    written: float = 0.0
    cost: float = 0.0

    @classmethod
    def of(cls, record: UnitRecord[Any], seconds: float) -> "Quantities":
        """Return the quantities of a unit that took some seconds."""
        usage: Usage = record.usage
        encoded = usage.context - usage.cached
        return cls(seconds, usage.requests, usage.context, encoded, usage.reply, usage.cost or 0.0)

    def plus(self, other: "Quantities", times: float = 1.0) -> "Quantities":
        """Return these quantities plus a multiple of others."""
        return Quantities(
            *(getattr(self, f.name) + times * getattr(other, f.name) for f in fields(self))
        )

    def beyond(self, other: "Quantities") -> "Quantities":
        """Return the excess over other quantities, at least 0."""
        return Quantities(
            *(max(0.0, getattr(self, f.name) - getattr(other, f.name)) for f in fields(self))
        )


@dataclass(frozen=True)
class _MeasuredGroup:
    """A group's frames, task and quantities of measured units, task and reason of failed ones."""

    frames: int
    quantities: Sequence[tuple[str, Quantities]]
    failures: Sequence[tuple[str, str]] = ()


@dataclass(frozen=True)
class TaskEstimate:
    """The estimated total of one task, whose frames are counted once in each group."""

    task: str
    n_units: int
    n_measured: int
    frames: int
    total: Quantities


@dataclass(frozen=True)
class Estimate:
    """A run's estimate by task (none if all failed), and task and reason of each failed unit."""

    workload: Workload
    tasks: Sequence[TaskEstimate]
    failures: Sequence[tuple[str, str]]


def estimate_run(
    request: RunRequest,
    suite: Suite[SuiteUnit, Payload],
    n_units: int,
    advance: Callable[[], None],
) -> Estimate:
    """Load the subject, do about `n_units` units of each task, and estimate the quantities of all.

    Nothing is written. `advance` is called after each measured group.

    Raises:
        InfthorError: as `execute`.
    """
    with closing(bind_run(prepare(request, suite))) as bound:
        workload = bound.evaluation.workload
        groups = []
        for group in _measure(bound.evaluation, n_units, RecordEncoder(suite.records)):
            groups.append(group)
            advance()
    failures = [failure for group in groups for failure in group.failures]
    is_measured = any(group.quantities for group in groups)
    return Estimate(workload, estimate_tasks(workload, groups) if is_measured else (), failures)


def _measure(
    evaluation: BoundEvaluation[SuiteUnit, Payload], n_units: int, encoder: RecordEncoder[Payload]
) -> Iterator[_MeasuredGroup]:
    """Do a few units of each task: of groups of all sizes, the first, middle and last unit."""
    session = UnrecordedSession()
    for group in _choose_groups(
        evaluation.workload.groups, max(1, round(n_units / _UNITS_OF_A_GROUP))
    ):
        units = list(group.units)
        part = list(dict.fromkeys((0, len(units) // 2, len(units) - 1)))
        quantities = []
        failures = []
        few = replace(group, units=[units[n] for n in part])
        start = time.perf_counter()
        for record in group_records(evaluation, few, session, encoder):
            now = time.perf_counter()
            if record.failure is None:
                quantities.append((record.task, Quantities.of(record, now - start)))
            else:
                failures.append((record.task, record.failure))
            start = now
        yield _MeasuredGroup(group.frames, quantities, failures)


def _choose_groups(groups: Sequence[Group[SuiteUnit]], n: int) -> Iterator[Group[SuiteUnit]]:
    """Yield n groups of each task, evenly from the smallest to the largest."""
    by_task: dict[str, list[Group[SuiteUnit]]] = {}
    for group in groups:
        by_task.setdefault(group.units[0].key.task, []).append(group)
    for same in by_task.values():
        ordered = sorted(same, key=lambda group: (group.frames, len(group.units)))
        n_taken = min(n, len(ordered))
        yield from (ordered[(2 * k + 1) * len(ordered) // (2 * n_taken)] for k in range(n_taken))


def estimate_tasks(
    workload: Workload[Unit[Any]], measured: Sequence[_MeasuredGroup]
) -> list[TaskEstimate]:
    """Estimate each task of a workload by measured groups with a unit that has not failed."""
    later = _later_units(measured)
    excess = _first_unit_excess(measured, later)
    estimates = []
    for task in dict.fromkeys(unit.key.task for group in workload.groups for unit in group.units):
        total = Quantities()
        n_units = 0
        frames = 0
        for group in workload.groups:
            n = sum(unit.key.task == task for unit in group.units)
            share = n / len(group.units)  # a group may have units of several tasks
            total = total.plus(excess(group), group.frames * share).plus(
                later.get(task, later[""]), n
            )
            n_units = n_units + n
            frames = frames + round(group.frames * share)
        n_measured = sum(name == task for group in measured for name, _ in group.quantities)
        estimates.append(TaskEstimate(task, n_units, n_measured, frames, total))
    return estimates


def _later_units(measured: Sequence[_MeasuredGroup]) -> Mapping[str, Quantities]:
    """Return mean quantities of units not first in their group, by task; under "" of all tasks."""
    by_task: dict[str, list[Quantities]] = {}
    for group in measured:
        for task, quantities in group.quantities[1:] or group.quantities:
            by_task.setdefault(task, []).append(quantities)
            by_task.setdefault("", []).append(quantities)
    return {task: _mean(of_task) for task, of_task in by_task.items()}


def _first_unit_excess(
    measured: Sequence[_MeasuredGroup], later: Mapping[str, Quantities]
) -> Callable[[Group[Unit[Any]]], Quantities]:
    """Return a function of a group: a first unit's excess over later ones per frame in its task."""
    totals: dict[str, Quantities] = {}
    frames: Counter[str] = Counter()
    for group in measured:
        if len(group.quantities) > 1:
            task, first = group.quantities[0]
            totals[task] = totals.get(task, Quantities()).plus(first.beyond(later[task]))
            frames[task] += group.frames

    def excess(group: Group[Unit[Any]]) -> Quantities:
        task = next((unit.key.task for unit in group.units if unit.key.task in totals), None)
        return Quantities() if task is None else Quantities().plus(totals[task], 1 / frames[task])

    return excess


def _mean(measured: Sequence[Quantities]) -> Quantities:
    total = Quantities()
    for quantities in measured:
        total = total.plus(quantities, 1 / len(measured))
    return total
