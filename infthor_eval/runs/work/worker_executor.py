"""A run by several workers: each loads the subject, does groups, and writes a shard of the journal.

The driver loads no model. It learns the run's header and workload from the first worker, and hands
out groups by number, each with the records that earlier runs or a lost worker left of it. So
nothing travels but numbers and records.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Generic

from infthor_eval.errors import UsageError, UserCodeError
from infthor_eval.runs.config import RunConfig
from infthor_eval.runs.journals.journal import Journal
from infthor_eval.runs.journals.record_encoder import RecordEncoder
from infthor_eval.runs.journals.records import (
    Payload,
    RunHeader,
    SuiteUnit,
    Unit,
    UnitKey,
    UnitRecord,
)
from infthor_eval.runs.journals.requests import StoredRequest
from infthor_eval.runs.request import PreparedRun
from infthor_eval.runs.suite import Group, Workload
from infthor_eval.runs.work.binding import bind_run, group_records
from infthor_eval.terminal import print_error
from infthor_eval.workers import Event, JobFailed, JobResult, Pool, WorkerLost, WorkerWithdrawn

_SHARD_WAIT_S = 20.0
# A unit that kills its worker (out of memory, say) must not fail the others of its group: after so
# many losses in a row the group is split, and each of its units gets so many tries alone.
_GROUP_TRIES = 3
_UNIT_TRIES = 2


@dataclass(frozen=True)
class _Greeting:
    """What a worker tells before it gets work: units without what only the suite needs."""

    header: RunHeader
    workload: Workload[Unit[Any]]


@dataclass(frozen=True)
class _Portion:
    """A group of the workload by its number, or one unit of it; `unit` is None for all of them."""

    group: int
    unit: int | None = None

    def select(self, groups: Sequence[Group[SuiteUnit]]) -> Group[SuiteUnit]:
        group = groups[self.group]
        return group if self.unit is None else replace(group, units=[group.units[self.unit]])


@dataclass(frozen=True)
class _GroupJob(Generic[Payload]):
    """A portion for a worker to do, with the latest records of its units."""

    portion: _Portion
    folder: Path
    earlier: tuple[UnitRecord[Payload], ...]


def _without_inputs(group: Group[SuiteUnit]) -> Group[Unit[Any]]:
    return Group([unit.without_inputs() for unit in group.units], group.frames)


def _cost(group: Group[Any]) -> tuple[int, int]:
    """Return what a group's cost grows with, what its units share first."""
    return group.frames, len(group.units)


class _Evaluator(Generic[SuiteUnit, Payload]):
    """A worker of a run; see `infthor_eval.workers.Worker`."""

    def __init__(self, run: PreparedRun[SuiteUnit, Payload], number: int) -> None:
        self._records = run.suite.records
        self._encoder = RecordEncoder(run.suite.records)
        self._number = number
        self._bound = bind_run(run)
        self._journal: Journal[Payload] | None = None
        self._named: set[str] = set()  # the requests that the driver knows

    @property
    def greeting(self) -> _Greeting:
        workload = self._bound.evaluation.workload
        groups = [_without_inputs(group) for group in workload.groups]
        parts = (workload.skipped, workload.config, workload.costs, workload.warnings)
        return _Greeting(self._bound.header, Workload(groups, *parts))

    def do(
        self, job: _GroupJob[Payload]
    ) -> Iterator[tuple[UnitRecord[Payload], bool, StoredRequest | None]]:
        """Yield records, whether they were there, and their requests when they are first named."""
        evaluation = self._bound.evaluation
        journal = self._open_journal(job.folder)
        for record in job.earlier:
            journal.add(record)
        group = job.portion.select(evaluation.workload.groups)
        for made in group_records(evaluation, group, journal, self._encoder):
            record, resumed = journal.append_new(made)
            is_new = not resumed and record.request not in self._named
            self._named.add(record.request)
            request = journal.find_artifact(record.request, StoredRequest) if is_new else None
            yield record, resumed, request

    def close(self) -> None:
        try:
            self._bound.close()
        except UserCodeError as error:  # all results are sent
            print_error(str(error))

    def _open_journal(self, folder: Path) -> Journal[Payload]:
        if self._journal is None:
            # A worker of a driver that was killed may still be ending, and holds the lock of the
            # shard until then.
            self._journal = Journal(
                folder, self._bound.header, self._records, worker=self._number, wait_s=_SHARD_WAIT_S
            )
        return self._journal


@dataclass(frozen=True)
class _Progress(Generic[Payload]):
    """A run's state that all portions share; `done` are the units whose records were yielded."""

    folder: Path
    journal: Journal[Payload]
    should_stop: Callable[[], bool]
    done: set[UnitKey] = field(default_factory=set)


class WorkerPoolExecutor(Generic[SuiteUnit, Payload]):
    """The executor of several workers; see `infthor_eval.runs.work.executor.Executor`."""

    def __init__(self, run: PreparedRun[SuiteUnit, Payload], notify: Callable[[str], None]) -> None:
        """Start the workers and wait for the first; `notify` is called when one is lost or cannot
        be started.
        """
        self._notify = notify
        self._expected: RunConfig[Any] | None = None
        settings = run.request.worker_settings
        self._n_workers = settings.workers
        connect = settings.connect(partial(_Evaluator, run))
        self._pool = Pool(connect, settings.workers, self._check_config)
        try:
            greeting: _Greeting = self._pool.open()
        except BaseException:
            self._pool.close()
            raise
        self.header = greeting.header
        self.workload = greeting.workload

    def evaluate(
        self, folder: Path, journal: Journal[Payload], should_stop: Callable[[], bool]
    ) -> Iterator[tuple[UnitRecord[Payload], bool]]:
        """See `Executor`."""
        groups = self.workload.groups
        progress = _Progress(folder, journal, should_stop)
        # The dearest first: one that is begun last would keep a worker busy for long while the
        # others have nothing left to do.
        order = sorted(range(len(groups)), key=lambda n: _cost(groups[n]), reverse=True)
        given_up = yield from self._do_portions(
            [_Portion(n) for n in order], progress, _GROUP_TRIES
        )
        # Some unit in them is to blame; the others must not fail with it.
        alone = [
            _Portion(portion.group, number)
            for portion in given_up
            for number, unit in enumerate(portion.select(groups).units)
            if unit.key not in progress.done
        ]
        for portion, reason in (yield from self._do_portions(alone, progress, _UNIT_TRIES)).items():
            (unit,) = portion.select(groups).units
            failure = (
                f"worker after worker was lost at it ({reason}); give it more memory, or leave it "
                "out"
            )
            yield journal.append(unit.record_failure(failure)), False
        for worker in range(1, self._n_workers + 1):
            journal.reread(worker)  # for cached artifacts, of which workers send requests alone

    def _do_portions(
        self, portions: Sequence[_Portion], progress: _Progress[Payload], max_losses: int
    ) -> Generator[tuple[UnitRecord[Payload], bool], None, dict[_Portion, str]]:
        """Have portions done; yield records, and return those given up, with the reason."""
        journal = progress.journal
        given_up: dict[_Portion, str] = {}

        def job(number: int) -> _GroupJob[Payload]:
            keys = [unit.key for unit in portions[number].select(self.workload.groups).units]
            return _GroupJob(portions[number], progress.folder, journal.latest_records(keys))

        for event in self._pool.run(len(portions), job, progress.should_stop, max_losses):
            self._report_loss(event)
            if isinstance(event, JobResult):
                record, resumed, request = event.result
                if not resumed:
                    journal.add_from(event.worker, record, request)
                if record.key not in progress.done:
                    progress.done.add(record.key)
                    yield record, resumed
            elif isinstance(event, WorkerLost | JobFailed):
                # It may have written records that it could no longer send.
                journal.reread(event.worker)
            if isinstance(event, JobFailed):
                given_up[portions[event.job]] = event.reason
        return given_up

    def close(self) -> None:
        """See `Executor`."""
        self._pool.close()

    def _check_config(self, greeting: _Greeting) -> None:
        """Refuse a worker that would evaluate something else: another version, a changed model."""
        theirs = greeting.header.config
        if self._expected is None:
            self._expected = theirs
        elif self._expected != theirs:
            fields = ", ".join(self._expected.differing(theirs))
            raise UsageError(
                f"the workers differ in {fields}; give all nodes the same versions and data"
            )

    def _report_loss(self, event: Event) -> None:
        if isinstance(event, WorkerLost):
            self._notify(f"{event.reason}; what it had not finished goes to another")
        elif isinstance(event, WorkerWithdrawn):
            self._notify(
                f"worker {event.worker} cannot be started, the others go on: {event.reason}"
            )
