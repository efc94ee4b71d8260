"""A run by several workers: each loads the subject, does groups, and writes a shard of the journal.

The driver loads nothing. A worker tells it who the run is and what there is to do; it hands out groups, each with the
records that earlier runs, or a worker that was lost, left of it.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.formats.digests import canonical_json
from infthor_eval.runs.executor import Recorded, View
from infthor_eval.runs.groups import group_records
from infthor_eval.runs.identity import header_of
from infthor_eval.runs.journal import Journal
from infthor_eval.runs.records import RunHeader, Unit, UnitKey, UnitRecord
from infthor_eval.runs.request import PreparedRun
from infthor_eval.runs.session import JournalSession
from infthor_eval.runs.subjects import subject_of
from infthor_eval.runs.suite import Group, UnitSample, Workload
from infthor_eval.workers import Event, GivenUp, Lost, Made, Pool, Withdrawn

__all__ = ["WorkerPoolExecutor"]

_PARTING_S = 20.0
_PATIENCE = 3  # losses in a row at a group before its units are tried one by one
_PATIENCE_ALONE = 2  # and at one of these before it has failed


@dataclass(frozen=True)
class _Greeting:
    """What a worker finds: who the run is, and what there is to do, without what only the suite needs of it."""

    header: RunHeader
    workload: Workload


@dataclass(frozen=True)
class _Portion:
    """A group, or one unit of it.

    Attributes:
        group: its number, in the order of the workload.
        unit: its number in the group; None for all of them.
    """

    group: int
    unit: int | None = None

    def of(self, workload: Workload) -> Group:
        """What is to be done."""
        group = workload.groups[self.group]
        return group if self.unit is None else replace(group, units=[group.units[self.unit]])


@dataclass(frozen=True)
class _GroupOrder:
    """One group to be done, or a unit of it alone.

    Attributes:
        portion: which.
        folder: the run's.
        known: the latest records of its units.
    """

    portion: "_Portion"
    folder: Path
    known: tuple[UnitRecord[Any], ...]


@dataclass(frozen=True)
class _ViewOrder:
    """Records to be seen by other readers."""

    records: tuple[UnitRecord[Any], ...]


@dataclass(frozen=True)
class _OpenEvaluator:
    """Makes the worker where it is to work."""

    run: PreparedRun

    def __call__(self, number: int) -> "_Evaluator":
        return _Evaluator(self.run, number)


class _Evaluator:
    """A worker of a run; see `infthor_eval.workers.Worker`."""

    def __init__(self, run: PreparedRun, number: int) -> None:
        self._run = run
        self._number = number
        self._subject = subject_of(run)
        self._workload = run.evaluation.workload(self._subject)
        self._header = header_of(run, self._subject, self._workload)
        self._session: JournalSession | None = None

    @property
    def greeting(self) -> _Greeting:
        groups = [replace(group, units=list(map(_plain, group.units)), context=None) for group in self._workload.groups]
        return _Greeting(self._header, replace(self._workload, groups=groups))

    def do(self, job: _GroupOrder | _ViewOrder) -> Iterator[Recorded | UnitSample]:
        if isinstance(job, _ViewOrder):
            yield from map(self._run.evaluation.view, job.records)
            return
        session = self._session_in(job.folder)
        for record in job.known:
            session.journal.take(record)
        for record in group_records(self._run.evaluation, job.portion.of(self._workload), session):
            yield session.recorded(record)

    def close(self) -> None:
        self._run.evaluation.close()
        self._subject.close()

    def _session_in(self, folder: Path) -> JournalSession:
        if self._session is None:
            # A worker of a driver that was killed may still be ending.
            types = self._run.suite.records
            journal = Journal(folder, self._header, types, worker=self._number, patience_s=_PARTING_S)
            self._session = JournalSession(self._subject, journal)
        return self._session


@dataclass(frozen=True)
class _Sharing:
    """What is the same for all portions of a run.

    Attributes:
        folder: the run's.
        journal: the driver's shard.
        should_stop: see `Executor.evaluate`.
        done: the units whose records were given.
    """

    folder: Path
    journal: Journal
    should_stop: Callable[[], bool]
    done: set[UnitKey] = field(default_factory=set)


def _plain(unit: Unit[Any]) -> Unit[Any]:
    return Unit(unit.key, unit.cluster, unit.payload)


class WorkerPoolExecutor:
    """Several workers; see `infthor_eval.runs.executor.Executor`."""

    def __init__(self, run: PreparedRun, say: Callable[[str], None]) -> None:
        """Find where the workers are to be; none is started yet.

        Args:
            run: what they evaluate; it is sent to each of them.
            say: is told what becomes of workers, a line each.

        Raises:
            UsageError: there is no such cluster.
        """
        worker_settings = run.request.worker_settings
        self._first: _Greeting | None = None
        self._say = say
        self._n_workers = worker_settings.workers
        self._pool = Pool(worker_settings.connect(_OpenEvaluator(run)), worker_settings.workers, self._accept)

    def begin(self) -> tuple[RunHeader, Workload]:
        """See `Executor`."""
        self._first = self._pool.open()
        return self._first.header, self._first.workload

    def evaluate(self, folder: Path, journal: Journal, should_stop: Callable[[], bool]) -> Iterator[Recorded]:
        """See `Executor`."""
        assert self._first is not None  # begun
        work = self._first.workload
        sharing = _Sharing(folder, journal, should_stop)
        given_up = yield from self._shared([_Portion(n) for n in range(len(work.groups))], sharing, _PATIENCE)
        # Some unit in them is to blame; the others are not to fail with it.
        alone = [
            _Portion(portion.group, number)
            for portion in given_up
            for number, unit in enumerate(portion.of(work).units)
            if unit.key not in sharing.done
        ]
        for portion, reason in (yield from self._shared(alone, sharing, _PATIENCE_ALONE)).items():
            (unit,) = portion.of(work).units
            told = f"worker after worker was lost at it ({reason}); give it more memory, or leave it out"
            yield journal.append(unit.failed(told)), False
        for worker in range(1, self._n_workers + 1):
            journal.reread(worker)  # memos, which are not told

    def _shared(
        self, portions: Sequence[_Portion], sharing: "_Sharing", patience: int
    ) -> Generator[Recorded, None, dict[_Portion, str]]:
        """Have portions done; gives the records, and in the end the portions that were given up, with the reason."""
        assert self._first is not None
        work, journal = self._first.workload, sharing.journal
        given_up: dict[_Portion, str] = {}

        def order(number: int) -> _GroupOrder:
            keys = [unit.key for unit in portions[number].of(work).units]
            return _GroupOrder(portions[number], sharing.folder, journal.known_of(keys))

        for event in self._pool.run(len(portions), order, sharing.should_stop, patience):
            self._tell(event)
            if isinstance(event, Made):
                record, resumed = event.result
                if not resumed:
                    journal.take_from(event.worker, record)
                if record.key not in sharing.done:
                    sharing.done.add(record.key)
                    yield record, resumed
            elif isinstance(event, Lost | GivenUp):
                journal.reread(event.worker)  # it may have written what it could not send any more
            if isinstance(event, GivenUp):
                given_up[portions[event.job]] = event.reason
        return given_up

    def view(self, records: Sequence[UnitRecord[Any]]) -> View:
        """See `Executor`."""
        order = _ViewOrder(tuple(records))
        views = [event.result for event in self._pool.run(1, lambda _: order) if isinstance(event, Made)]
        found = dict(zip((record.key for record in records), views, strict=True))
        return lambda record: found[record.key]

    def close(self) -> None:
        """See `Executor`."""
        self._pool.close()

    def _accept(self, greeting: _Greeting) -> None:
        """Refuse a worker that would evaluate something else: another version, a model that has moved on."""
        if self._first is None:
            self._first = greeting
            return
        ours, theirs = self._first.header.identity, greeting.header.identity
        if canonical_json(ours) != canonical_json(theirs):
            differing = sorted(name for name in {*ours, *theirs} if ours.get(name) != theirs.get(name))
            raise UsageError(f"the workers differ in {', '.join(differing)}; give all nodes the same versions and data")

    def _tell(self, event: Event) -> None:
        if isinstance(event, Lost):
            self._say(f"{event.reason}; what it had not finished goes to another")
        elif isinstance(event, Withdrawn):
            self._say(f"worker {event.worker} cannot be started, the others go on: {event.reason}")
