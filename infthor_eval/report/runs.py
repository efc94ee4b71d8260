"""Runs as the report presents them: their headers, records and costs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

from infthor_eval.errors import UsageError
from infthor_eval.runs import RunHeader, RunSummary, Suite, UnitKey, UnitRecord, Usage, read_header
from infthor_eval.runs.journals.shards import read_run_log
from infthor_eval.runs.stored.command import read_stored_command
from infthor_eval.runs.stored.labels import label_runs
from infthor_eval.runs.stored.search import read_results

if TYPE_CHECKING:
    from infthor_eval.report.presenter import Presenter

__all__ = ["ReportRun", "choose_evenly", "label_report_runs", "read_report_runs", "records_by_unit"]

T = TypeVar("T")
_LONGEST_TASKS = 60  # characters of the tasks in a label


@dataclass(frozen=True)
class ReportRun:
    """A run.

    Attributes:
        folder: folder of the run.
        label: name of the run beside the others.
        model: name of the model, the same for runs that differ in other settings; with what
            replaces the frames.
        suite: suite of the run.
        presenter: presenter of the suite.
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
    presenter: "Presenter"
    header: RunHeader
    records: tuple[UnitRecord[Any], ...]
    usage: Usage
    n_missing: int | None
    command: str = ""
    data: Path | None = None

    @cached_property
    def summary(self) -> RunSummary:
        """Summary of the records."""
        return RunSummary(self.header, self.suite.summarise(self.header, self.records))

    @property
    def tasks(self) -> Mapping[str, Any]:
        """Configs of the tasks by name, of the suite's type (`RecordTypes.config`)."""
        tasks: Mapping[str, Any] = self.header.config.tasks
        return tasks

    @property
    def simulator(self) -> str:
        """Name of the simulator that the frames are from, or names separated by commas; empty if it
        is not known."""
        return ", ".join(self.header.config.simulators)

    def main_score(self, record: UnitRecord[Any]) -> float:
        """Return the score that decides whether a unit is right, 1 being right."""
        scores = self.suite.scores(record)
        main = self.presenter.main_metric
        if main is None:
            return next(iter(scores.values()), 0.0)
        return scores.get(main, max(scores.values(), default=0.0))

    def outcome(self, record: UnitRecord[Any]) -> str:
        """Return how a unit ended: "right", "partly", "wrong", "failed" or "excluded"."""
        if record.excluded is not None:
            return "excluded"
        if record.failure is not None:
            return "failed"
        score = self.main_score(record)
        return "right" if score >= 1 else "partly" if score > 0 else "wrong"


def read_report_runs(
    folders: Sequence[Path],
    find_suite: Callable[[str], Suite],
    find_presenter: Callable[[str], "Presenter"],
) -> list[ReportRun]:
    """Read runs from their folders, at least one; suites and their presenters are looked up by the
    suite's name.

    Raises:
        UsageError: a folder is given twice.
        DataError: a folder has no journal, or it cannot be read.
    """
    if len({folder.resolve() for folder in folders}) < len(folders):
        raise UsageError("one run is given twice; give each once")
    headers = [read_header(folder) for folder in folders]
    return [
        _read(folder, name, find_suite(header.suite), find_presenter(header.suite))
        for folder, header, name in zip(
            folders, headers, _distinct_names(folders, headers), strict=True
        )
    ]


def _read(folder: Path, name: str, suite: Suite, presenter: "Presenter") -> ReportRun:
    header, log = read_run_log(folder, suite.records)
    results = read_results(folder)
    command = read_stored_command(folder)
    return ReportRun(
        folder=folder,
        label=_with_frames(name, header),
        model=_with_frames(header.name, header),
        suite=suite,
        presenter=presenter,
        header=msgspec.structs.replace(header, name=name),
        records=tuple(log.records),
        usage=log.usage,
        n_missing=results.n_missing if results else None,
        command=command.line if command else "",
        data=command.data if command else None,
    )


def label_report_runs(folders: Sequence[Path], headers: Sequence[RunHeader]) -> list[str]:
    """Return a label per run: its name, with the options that tell runs of one name apart, or with
    its folder.

    Raises:
        DataError: the `run.yaml` of a run is not what it should be.
    """
    return [
        _with_frames(*named)
        for named in zip(_distinct_names(folders, headers), headers, strict=True)
    ]


def _distinct_names(folders: Sequence[Path], headers: Sequence[RunHeader]) -> list[str]:
    """Return a name per run; the frames are not part of it, since tables add them to the name."""
    names = label_runs(list(zip(folders, headers, strict=True)), ignore={"frames"})
    tasks = ["+".join(sorted(header.config.tasks))[:_LONGEST_TASKS] for header in headers]
    keys = [
        (name, header.suite, header.config.frames)
        for name, header in zip(names, headers, strict=True)
    ]
    with_tasks = list(zip(keys, tasks, strict=True))
    for place, key in enumerate(keys):
        if keys.count(key) > 1:
            is_told_by_tasks = with_tasks.count(with_tasks[place]) == 1
            names[place] += f" ({tasks[place] if is_told_by_tasks else folders[place].name})"
    return names


def _with_frames(name: str, header: RunHeader) -> str:
    frames = header.config.frames
    return name if frames in ("", "shown") else f"{name}, {frames} frames"


def choose_evenly(items: Sequence[T], n: int) -> list[T]:
    """Return n items, evenly spaced from the first to the last; all of them if there are no
    more."""
    if len(items) <= n:
        return list(items)
    return [items[round(number * (len(items) - 1) / max(n - 1, 1))] for number in range(n)]


def records_by_unit(runs: Sequence[ReportRun]) -> Mapping[UnitKey, list[UnitRecord[Any] | None]]:
    """Return the records of each unit, with a place per run, in the order of the units' keys."""
    units: dict[UnitKey, list[UnitRecord[Any] | None]] = {}
    for place, run in enumerate(runs):
        for record in run.records:
            units.setdefault(record.key, [None] * len(runs))[place] = record
    return dict(sorted(units.items()))
