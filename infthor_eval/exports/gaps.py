"""What a run leaves out, and why: every export says so where it gives a score."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec

from infthor_eval.reasons import count_reasons
from infthor_eval.run import Run
from infthor_eval.runs import TaskConfig


@dataclass(frozen=True)
class TaskGaps:
    """What is left out of a task's scores.

    Attributes:
        n_counted: number of records that are not excluded.
        n_missing: number of units of the whole run that were not attempted; None if unknown.
        failed: failed records by reason.
        excluded: excluded records by reason.
        skipped: units that could not be evaluated, by reason.
    """

    n_counted: int
    n_missing: int | None
    failed: Mapping[str, int]
    excluded: Mapping[str, int]
    skipped: Mapping[str, int]

    @property
    def n_failed(self) -> int:
        """Number of failed records."""
        return sum(self.failed.values())

    @property
    def is_whole(self) -> bool:
        """Whether every unit that can be evaluated has a result."""
        return self.n_missing == 0 and not self.failed


def task_config(run: Run, task: str) -> TaskConfig:
    """Return the config of a task; an empty one if its suite has configs of another kind."""
    config = run.tasks[task]
    return config if isinstance(config, TaskConfig) else TaskConfig()


def task_document(run: Run, task: str) -> Mapping[str, Any]:
    """Return the config of a task as JSON values, whatever its suite."""
    document: Mapping[str, Any] = msgspec.to_builtins(run.tasks[task], str_keys=True)
    return document


def dataset_name(run: Run, task: str) -> str:
    """Return the name of a task's data set: the bundled one's, else the task's."""
    return str(task_config(run, task).dataset_kwargs.get("bundled", task))


def task_gaps(run: Run, task: str) -> TaskGaps:
    """Return what is left out of a task."""
    records = [record for record in run.records if record.task == task]
    return TaskGaps(
        n_counted=sum(record.excluded is None for record in records),
        n_missing=run.n_missing,
        failed=_count(it.failure for it in records if it.excluded is None),
        excluded=_count(record.excluded for record in records),
        skipped=_count(task_config(run, task).skip_reasons),
    )


def describe_gaps(gaps: TaskGaps) -> str:
    """Return what is not whole, in words; empty if all is there."""
    n_missing = gaps.n_missing
    parts = [
        "it is not known whether all of the run is done" if n_missing is None else "",
        f"{n_missing} of the run's units not done" if n_missing else "",
        f"{gaps.n_failed} of {gaps.n_counted} failed, in no score" if gaps.failed else "",
        f"{sum(gaps.excluded.values())} excluded" if gaps.excluded else "",
        f"{sum(gaps.skipped.values())} could not be evaluated" if gaps.skipped else "",
    ]
    return "; ".join(filter(None, parts))


def gap_notes(run: Run) -> list[str]:
    """Return a line for each task of which something is left out."""
    described = {task: describe_gaps(task_gaps(run, task)) for task in run.tasks}
    return [f"{run.label}, {task}: {words}" for task, words in described.items() if words]


def _count(reasons: Iterable[str | None]) -> dict[str, int]:
    named = (("", reason) for reason in reasons if reason is not None)
    return {reason: n for _, reason, n in count_reasons(named)}
