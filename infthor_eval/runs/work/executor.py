"""Who does a run's work: this process, or several workers; either way the same records."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Event, Thread
from typing import Any, Generic, Protocol

from infthor_eval.runs.journals.journal import Journal
from infthor_eval.runs.journals.record_encoder import RecordEncoder
from infthor_eval.runs.journals.records import (
    Artifact,
    Payload,
    RunHeader,
    SuiteUnit,
    Unit,
    UnitRecord,
    describe_failure,
)
from infthor_eval.runs.request import PreparedRun
from infthor_eval.runs.suite import Group, Workload
from infthor_eval.runs.usage import NOTHING, Usage
from infthor_eval.runs.work.batches import fetch_replies
from infthor_eval.runs.work.binding import bind_run, group_records
from model_adapters import BatchModel, PersonModel, Subject


class Executor(Protocol[Payload]):
    """Does the work of a run. It is ready as soon as it is created."""

    @property
    def header(self) -> RunHeader:
        """Header of the run's journal."""

    @property
    def workload(self) -> Workload[Unit[Any]]:
        """All the work."""

    def evaluate(
        self, folder: Path, journal: Journal[Payload], should_stop: Callable[[], bool]
    ) -> Iterator[tuple[UnitRecord[Payload], bool]]:
        """Do all groups, or stop after the units in hand; yield each record once it is on disk."""

    def close(self) -> None:
        """Release everything, in whatever state it is."""


class LocalExecutor(Generic[SuiteUnit, Payload]):
    """The executor of this process."""

    def __init__(
        self,
        run: PreparedRun[SuiteUnit, Payload],
        notify: Callable[[str], None],
        loaded: Subject | None = None,
    ) -> None:
        """Load the subject, unless it is given, and find the work; `notify` is called for each
        batch."""
        self._notify = notify
        self._bound = bind_run(run, loaded)
        self._encoder = RecordEncoder(run.suite.records)
        self.header = self._bound.header
        self.workload = self._bound.evaluation.workload

    def evaluate(
        self, folder: Path, journal: Journal[Payload], should_stop: Callable[[], bool]
    ) -> Iterator[tuple[UnitRecord[Payload], bool]]:
        """See `Executor`."""
        evaluation = self._bound.evaluation
        subject = self._bound.subject
        if isinstance(subject, BatchModel) and subject.uses_batches:
            given = (evaluation, journal, self._encoder, folder, self._notify, should_stop)
            if not fetch_replies(subject, *given):
                return
        in_flight = subject.capabilities.max_in_flight
        records = run_groups(
            self.workload.groups,
            lambda group: group_records(evaluation, group, journal, self._encoder),
            in_flight,
        )
        for record in self._showing_positions(records):
            yield journal.append_new(record)
            if should_stop():
                return

    def _showing_positions(
        self, records: Iterator[UnitRecord[Payload]]
    ) -> Iterator[UnitRecord[Payload]]:
        """Yield the records, and tell a person which unit comes next, before it is asked."""
        subject, n_units = self._bound.subject, self.workload.n_units
        if not isinstance(subject, PersonModel):
            yield from records
            return
        for number in range(1, n_units + 1):
            subject.show_position(number, n_units)
            yield from islice(records, 1)

    def close(self) -> None:
        """See `Executor`."""
        self._bound.close()


class UnrecordedSession:
    """A `Session` without a journal: every unit is done; artifacts are cached in memory."""

    def __init__(self) -> None:
        self._artifacts: dict[str, Any] = {}

    def find_record(self, unit: Unit[Any], fingerprint: str) -> None:
        """Return None: there are no records."""

    def describe_failure(self, unit: Unit[Any], error: BaseException) -> str:
        """See `Session`; nothing is written."""
        return describe_failure(error)

    def find_artifact(self, fingerprint: str, kind: type[Artifact]) -> Artifact | None:
        """See `Session`."""
        return self._artifacts.get(fingerprint)

    def cache_artifact(self, fingerprint: str, artifact: Any, usage: Usage = NOTHING) -> None:
        """See `Session`."""
        self._artifacts[fingerprint] = artifact


def run_groups(
    groups: Sequence[Group[SuiteUnit]],
    do: Callable[[Group[SuiteUnit]], Iterable[UnitRecord[Payload]]],
    max_in_flight: int,
) -> Iterator[UnitRecord[Payload]]:
    """Yield all groups' records when they are there; several in flight have a thread each."""
    if max_in_flight == 1 or len(groups) <= 1:
        for group in groups:
            yield from do(group)
    else:
        yield from _in_threads(groups, do, min(max_in_flight, len(groups)))


def _in_threads(
    groups: Sequence[Group[SuiteUnit]],
    do: Callable[[Group[SuiteUnit]], Iterable[UnitRecord[Payload]]],
    n_threads: int,
) -> Iterator[UnitRecord[Payload]]:
    waiting: SimpleQueue[Group[SuiteUnit]] = SimpleQueue()
    for group in groups:
        waiting.put(group)
    # None: a thread has ended.
    results: SimpleQueue[UnitRecord[Payload] | BaseException | None] = SimpleQueue()
    stop = Event()
    threads = [
        Thread(target=_work, args=(waiting, do, results, stop), daemon=True)
        for _ in range(n_threads)
    ]
    for thread in threads:
        thread.start()
    running = n_threads
    try:
        while running:
            result = results.get()
            if isinstance(result, BaseException):
                raise result
            if result is None:
                running -= 1
            else:
                yield result
    finally:
        stop.set()


def _work(
    waiting: "SimpleQueue[Group[SuiteUnit]]",
    do: Callable[[Group[SuiteUnit]], Iterable[UnitRecord[Payload]]],
    results: "SimpleQueue[UnitRecord[Payload] | BaseException | None]",
    stop: Event,
) -> None:
    try:
        while (group := _next(waiting)) is not None and not stop.is_set():
            for record in do(group):
                results.put(record)
                if stop.is_set():
                    return
    except BaseException as error:  # noqa: BLE001 - raised again in the thread that waits
        results.put(error)
    else:
        results.put(None)


def _next(waiting: "SimpleQueue[Group[SuiteUnit]]") -> Group[SuiteUnit] | None:
    """Return the next group, or None if there is none."""
    try:  # rather than a check whether it is empty: another thread may take the last group after it
        return waiting.get_nowait()
    except Empty:
        return None
