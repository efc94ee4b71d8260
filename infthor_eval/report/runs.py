"""Runs as the report presents them: their headers, records and costs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from infthor_eval.runs import RunHeader, RunSummary, Suite, UnitKey, UnitRecord, Usage
from infthor_eval.runs.stored.labels import label_runs

T = TypeVar("T")
_LONGEST_TASKS = 60  # characters of the tasks in a label


@dataclass(frozen=True)
class ReportRun:
    """A run.

    Attributes:
        folder: folder of the run.
        label: name of the run beside the others, with a mark if the run is not whole.
        model: name of the model, the same for runs that differ in other settings; with what
            replaces the frames, and the mark.
        suite: suite of the run.
        header: first line of the journal; its name has the options that tell runs of one name
            apart.
        records: records of all units.
        usage: tokens and requests of the whole run.
        n_missing: number of units that were not attempted; None if unknown.
        command: command that repeats the run; empty if unknown.
        data: folder of the data set, if the command named one.
    """

    folder: Path
    label: str
    model: str
    suite: Suite
    header: RunHeader
    records: tuple[UnitRecord[Any], ...]
    usage: Usage
    n_missing: int | None
    command: str = ""
    data: Path | None = None

    @cached_property
    def summary(self) -> RunSummary:
        """Summary of the records."""
        return RunSummary.of(self.suite, self.header, self.records)

    @property
    def tasks(self) -> Mapping[str, Any]:
        """Configs of the tasks by name, of the suite's type (`RecordTypes.config`)."""
        tasks: Mapping[str, Any] = self.header.config.tasks
        return tasks

    @property
    def simulator(self) -> str:
        """Names of the frames' simulators, separated by commas; empty if not known."""
        return ", ".join(self.header.config.simulators)


def distinct_names(folders: Sequence[Path], headers: Sequence[RunHeader]) -> list[str]:
    """Return a name per run; the frames are not part of it, since tables add them to the name."""
    names = label_runs(list(zip(folders, headers, strict=True)), ignore={"frames"})
    tasks = ["+".join(sorted(header.config.tasks))[:_LONGEST_TASKS] for header in headers]
    keys = [
        (name, header.suite, header.config.frames)
        for name, header in zip(names, headers, strict=True)
    ]
    with_tasks = list(zip(keys, tasks, strict=True))
    for position, key in enumerate(keys):
        if keys.count(key) > 1:
            is_told_by_tasks = with_tasks.count(with_tasks[position]) == 1
            names[position] += (
                f" ({tasks[position] if is_told_by_tasks else folders[position].name})"
            )
    return names


def with_frames(name: str, header: RunHeader) -> str:
    """Return the name of a run, with its frame ablation if there is one."""
    frames = header.config.frames
    return name if frames in ("", "shown") else f"{name}, {frames} frames"


def choose_evenly(items: Sequence[T], n: int) -> list[T]:
    """Return n items, evenly spaced from the first to the last; all if there are no more."""
    if len(items) <= n:
        return list(items)
    return [items[round(number * (len(items) - 1) / max(n - 1, 1))] for number in range(n)]


def records_by_unit(runs: Sequence[ReportRun]) -> Mapping[UnitKey, list[UnitRecord[Any] | None]]:
    """Return the records of each unit, with a place per run, in the order of the units' keys."""
    units: dict[UnitKey, list[UnitRecord[Any] | None]] = {}
    for position, run in enumerate(runs):
        for record in run.records:
            units.setdefault(record.key, [None] * len(runs))[position] = record
    return dict(sorted(units.items()))
