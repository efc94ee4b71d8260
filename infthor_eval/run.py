"""A run as its folder holds it, for all who show, compare, explain or export it.

A journal that still grows is followed (`runs/journals/following.py`); all others read a run here.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Self

import msgspec

from infthor_eval.errors import DataError, InfthorError, UsageError
from infthor_eval.runs.completeness import UnitCounts, count_units
from infthor_eval.runs.journals.records import RunHeader, State, UnitRecord
from infthor_eval.runs.journals.requests import StoredRequest
from infthor_eval.runs.journals.shards import (
    Notify,
    RunLog,
    last_change,
    read_header,
    read_run_log,
    read_states,
)
from infthor_eval.runs.stored.command import StoredCommand, read_stored_command
from infthor_eval.runs.stored.search import Results, read_results, run_folders
from infthor_eval.runs.suite import RunSummary
from infthor_eval.runs.usage import NOTHING, Usage
from infthor_eval.suites import find_presenter, find_suite

if TYPE_CHECKING:
    from infthor_eval.rates import Rate
    from infthor_eval.report.plain import PlainPresenter
    from infthor_eval.runs.results import Stored
    from infthor_eval.runs.suite import Suite

_INCOMPLETE = " (incomplete)"  # ends the name of a run that is not whole
# Options that tell no run from another: they change no number, or are in labels in another way.
_NOT_IN_NAMES = {
    "out",
    "workers",
    "ray_address",
    "gpus_per_worker",
    "include_path",
    "name",
    "tasks",
    "frames",
}
_LONGEST_TASKS = 60  # characters of the tasks in a name


class Run:
    """A run. What is not asked for is not read.

    Attributes:
        folder: folder of the run.
        listed: first line of the journal; until that is read, its configs are JSON values, so that
            runs are listed without their suites.
        name: name of the run beside others; its own until `named`.
    """

    def __init__(self, folder: Path, listed: RunHeader, notify: Notify | None = None) -> None:
        """Take folder and header of a run; `notify` as in `read_run`."""
        self.folder = folder
        self.listed = listed
        self._notify = notify
        self.name = listed.name

    @classmethod
    def open(cls, folder: Path, notify: Notify | None = None) -> Self:
        """Open the run in a folder.

        Raises:
            DataError: there is no journal, or one of another format. What is read later may raise
                it, too, and UsageError where the suite of the run is not known here.
        """
        return cls(folder, read_header(folder), notify)

    @classmethod
    def held(
        cls,
        folder: Path,
        suite: Suite[Any, Any],
        summary: RunSummary,
        records: Sequence[UnitRecord[Any]] = (),
        usage: Usage = NOTHING,
        n_missing: int | None = None,
    ) -> Self:
        """Return a run of which this process has everything, so that nothing is read."""
        run = cls(folder, summary.header)
        run.suite = suite
        run.records = tuple(records)
        run.units = summary.units
        run.usage = usage
        run.n_missing = n_missing
        run.is_whole = not n_missing and all(counts.is_whole for counts in run.units.values())
        run.own_header = summary.header
        run._summed_up = summary.summary
        return run

    @classmethod
    def just_stored(cls, stored: Stored[Any], suite: Suite[Any, Any]) -> Self:
        """Return a run that this process has just stored; see `held`."""
        return cls.held(
            stored.folder, suite, stored.summary, stored.records, stored.usage, stored.n_missing
        )

    def named(self, name: str) -> Self:
        """Return the run by a name that it has beside others."""
        other = copy(self)
        other.name = name
        other.__dict__.pop("header", None)
        return other

    def read(self) -> Self:
        """Read the records now, so that what cannot be read is refused before any work."""
        _ = self.header  # which tells whether all units have a record
        return self

    @cached_property
    def suite(self) -> Suite[Any, Any]:
        """Its suite."""
        return find_suite(self.listed.suite)

    @cached_property
    def presenter(self) -> PlainPresenter:
        """The presenter of its suite."""
        return find_presenter(self.listed.suite)

    @cached_property
    def _log(self) -> tuple[RunHeader, RunLog[Any]]:
        return read_run_log(self.folder, self.suite.records, self._notify)

    @cached_property
    def own_header(self) -> RunHeader:
        """First line of the journal as it is, the configs of tasks in the suite's types."""
        self.listed = self._log[0]
        return self.listed

    @cached_property
    def header(self) -> RunHeader:
        """First line of the journal; its name is the one beside other runs, with a mark if the run
        is not whole."""
        return msgspec.structs.replace(self.own_header, name=self._marked(self.name))

    @cached_property
    def records(self) -> tuple[UnitRecord[Any], ...]:
        """The latest record of each unit."""
        return tuple(self._log[1].records)

    def requests(self, record: UnitRecord[Any]) -> Sequence[StoredRequest]:
        """Return the request of a record, behind those that it continues; none where the journal
        does not have them all."""
        return (record.request and self._log[1].requests_before(record.request)) or ()

    @property
    def stored_requests(self) -> Mapping[str, StoredRequest]:
        """All stored requests by the names that records have for them."""
        return self._log[1].requests

    @cached_property
    def usage(self) -> Usage:
        """Tokens and requests of the whole run."""
        return self._log[1].usage

    @cached_property
    def results(self) -> Results | None:
        """What `results.json` has; None before there is one."""
        return read_results(self.folder)

    @cached_property
    def n_missing(self) -> int | None:
        """Number of units that were not attempted; None if unknown."""
        n_units = self.listed.n_units
        if n_units is None:
            return None if self.results is None else self.results.n_missing
        return max(0, n_units - self.states.total())

    @cached_property
    def units(self) -> Mapping[str, UnitCounts]:
        """Numbers of units of each task by state."""
        return count_units(self.listed, self.records)

    @cached_property
    def _summed_up(self) -> Any:
        return self.suite.summarise(self.header, self.records)

    @property
    def summary(self) -> RunSummary:
        """Summary of the records."""
        return RunSummary(self.header, self._summed_up, self.units)

    @property
    def own_summary(self) -> RunSummary:
        """Summary of the records, by the run's own name."""
        return RunSummary(self.own_header, self._summed_up, self.units)

    @cached_property
    def states(self) -> Counter[State]:
        """Number of units with a record by state, read without the suite before the records are."""
        if "_log" in self.__dict__:
            return Counter(record.state for record in self.records)
        return Counter(read_states(self.folder, self._notify).values())

    @property
    def n_not_asked(self) -> int | None:
        """Number of units that were not attempted, or that a cap left out; None if neither header
        nor results tell."""
        return None if self.n_missing is None else self.n_missing + self.states["not asked"]

    @cached_property
    def is_whole(self) -> bool:
        """Whether no unit that can be done is known to lack a result."""
        return not self.states["failed"] and not self.n_not_asked

    @property
    def primary_metrics(self) -> Mapping[str, Rate]:
        """Primary metric of each task as `results.json` has it; empty before there is one."""
        return self.results.primary_metrics if self.results else {}

    @property
    def changed(self) -> datetime:
        """Time of the last change to the journal."""
        return last_change(self.folder)

    @cached_property
    def stored_command(self) -> StoredCommand | None:
        """The command that made the run; None if unknown."""
        return read_stored_command(self.folder)

    @property
    def command(self) -> str:
        """Command that repeats the run; empty if unknown."""
        return self.stored_command.line if self.stored_command else ""

    @property
    def data(self) -> Path | None:
        """Folder of the data set, if the command named one."""
        return self.stored_command.data if self.stored_command else None

    @property
    def label(self) -> str:
        """Name of the run beside the others, with what replaces the frames, and a mark if the run
        is not whole."""
        return self.listed.with_frames(self._marked(self.name))

    @property
    def model(self) -> str:
        """Name of the model, the same for runs that differ in other settings; with what replaces
        the frames, and the mark."""
        return self.listed.with_frames(self._marked(self.listed.name))

    def _marked(self, name: str) -> str:
        return name if self.is_whole else f"{name}{_INCOMPLETE}"

    @property
    def tasks(self) -> Mapping[str, Any]:
        """Configs of the tasks by name, of the suite's type (`RecordTypes.config`)."""
        tasks: Mapping[str, Any] = self.own_header.config.tasks
        return tasks

    @property
    def is_baseline(self) -> bool:
        """Whether a baseline replied, and no model."""
        return "baseline" in self.own_header.config.model

    @property
    def simulator(self) -> str:
        """Names of the frames' simulators, separated by commas; empty if not known."""
        return ", ".join(self.own_header.config.simulators)

    def main_score(self, record: UnitRecord[Any]) -> float:
        """Return the score that decides whether a unit is right, 1 being right."""
        scores = self.suite.scores(record)
        main = self.presenter.main_metric
        if main is None:
            return next(iter(scores.values()), 0.0)
        return scores.get(main, max(scores.values(), default=0.0))

    def outcome(self, record: UnitRecord[Any]) -> str:
        """Return how a unit ended: "right", "partly", "wrong", "failed", "not asked" or
        "excluded"."""
        if record.state != "answered":
            return record.state
        score = self.main_score(record)
        return "right" if score >= 1 else "partly" if score > 0 else "wrong"


@dataclass(frozen=True)
class BrokenRun:
    """The folder of a run that cannot be read, and why."""

    folder: Path
    reason: str


def open_runs(
    folders: Sequence[Path], notify: Notify | None = None, *, twice: bool = False
) -> list[Run]:
    """Open runs, at least one, under distinct names.

    Args:
        folders: their folders.
        notify: called with each bad line of a journal, see `read_run`.
        twice: whether a folder may be given twice.

    Raises:
        UsageError: a folder is given twice, or the suite of a run is not known here.
        DataError: a folder has no journal, or it cannot be read.
    """
    if not twice and len({folder.resolve() for folder in folders}) < len(folders):
        raise UsageError("one run is given twice; give each once")
    return with_distinct_names([Run.open(folder, notify).read() for folder in folders])


def with_distinct_names(runs: Sequence[Run]) -> list[Run]:
    """Return the runs by the names that they have beside each other, wherever they are shown.

    Runs of one suite and name are told apart by the options that differ: `qwen2.5-vl
    (dtype=float16)`. Those alike in these and in their frames, which `label` has, get their tasks
    behind that, or their folders if these are equal, too.
    """
    places = defaultdict(list)
    for place, run in enumerate(runs):
        places[run.listed.suite, run.listed.name].append(place)
    named = list(runs)
    for same in places.values():
        if len(same) > 1:  # otherwise no file is read
            for place, name in zip(same, _names_of([runs[it] for it in same]), strict=True):
                named[place] = runs[place].named(name)
    return named


def unmarked(label: str) -> str:
    """Return a label without the mark of a run that is not whole."""
    return label.removesuffix(_INCOMPLETE)


def _names_of(runs: Sequence[Run]) -> Iterator[str]:
    """Yield the names of runs of one name."""
    options = list(map(_options, runs))
    texts = {
        name: [of_run.get(name) for of_run in options]
        for name in sorted({name for of_run in options for name in of_run})
    }
    shortened = {name: _shorten(of_all) for name, of_all in texts.items() if len(set(of_all)) > 1}
    names = []
    for run, of_run in zip(runs, options, strict=True):
        differing = ", ".join(
            f"{name}={short[of_run[name]]}" for name, short in shortened.items() if name in of_run
        )
        names.append(f"{run.listed.name} ({differing})" if differing else run.listed.name)
    keys = [(name, run.listed.config.frames) for run, name in zip(runs, names, strict=True)]
    tasks = ["+".join(sorted(run.listed.config.tasks))[:_LONGEST_TASKS] for run in runs]
    with_tasks = list(zip(keys, tasks, strict=True))
    for place, run in enumerate(runs):
        is_told_by_tasks = with_tasks.count(with_tasks[place]) == 1
        more = f" ({tasks[place] if is_told_by_tasks else run.folder.name})"
        yield names[place] + (more if keys.count(keys[place]) > 1 else "")


def _options(run: Run) -> dict[str, str]:
    """Return the options of a run's command in words, those of the model among them."""
    every = dict(run.stored_command.options) if run.stored_command else {}
    of_model = every.pop("model_args", None)
    if isinstance(of_model, Mapping):
        every |= of_model
    in_words = run.listed.config.in_words
    return {
        name: in_words(name, str(value))
        for name, value in every.items()
        if name not in _NOT_IN_NAMES
    }


def _shorten(values: Sequence[str | None]) -> Mapping[str, str]:
    """Return the values as they are; paths without the folders that all of them share."""
    known = sorted({value for value in values if value is not None})
    parts = {value: PurePath(value).parts for value in known}
    if not all(PurePath(value).is_absolute() for value in known):
        return {value: value for value in known}
    shortest = min(map(len, parts.values())) - 1  # the last part is always shown
    n_shared = next(
        (n for n in range(shortest) if len({path[n] for path in parts.values()}) > 1), shortest
    )
    return {value: str(PurePath(*path[n_shared:])) for value, path in parts.items()}


def find_runs(folder: Path, notify: Notify | None = None) -> Iterator[Run | BrokenRun]:
    """Yield the runs below a folder, in the order of their paths, with their states and results.

    Raises:
        DataError: there is no such folder, or it cannot be searched.
    """
    if not folder.is_dir():
        raise DataError(
            f"{folder}: no such folder; give the results folder of a run (`--out`, else results)"
        )
    for path in run_folders(folder):
        try:
            run = Run.open(path, notify)
            _ = run.states, run.results
        except InfthorError as error:
            yield BrokenRun(path, str(error))
        else:
            yield run
