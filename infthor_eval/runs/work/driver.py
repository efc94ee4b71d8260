"""One run of any suite: its journal, the order of its work, its results."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol

from infthor_eval.errors import UserCodeError
from infthor_eval.runs.journals import journal as journals
from infthor_eval.runs.journals.journal import Journal
from infthor_eval.runs.journals.records import Payload, SuiteUnit, Unit, UnitRecord
from infthor_eval.runs.request import PreparedRun
from infthor_eval.runs.results import Stored, store_results
from infthor_eval.runs.stored.command import write_command
from infthor_eval.runs.suite import UnitDoc, Workload
from infthor_eval.runs.work.executor import Executor, LocalExecutor
from infthor_eval.runs.work.worker_executor import WorkerPoolExecutor
from model_adapters import Subject


class Observer(Protocol):
    """Follows a run."""

    def begin(self, workload: Workload[Unit[Any]], n_recovered: int) -> None:
        """Called before the first unit, with all the work and the number of bad lines removed."""

    def done(self, record: UnitRecord[Any], resumed: bool) -> None:
        """Called for each unit; `resumed` if its record is that of an earlier, stopped run."""

    def notify(self, text: str) -> None:
        """Called with a line when a worker is lost, or a batch of requests begins or ends."""


class Silent:
    """An observer that does nothing."""

    def begin(self, workload: Workload[Unit[Any]], n_recovered: int) -> None:
        """Nothing."""

    def done(self, record: UnitRecord[Any], resumed: bool) -> None:
        """Nothing."""

    def notify(self, text: str) -> None:
        """Nothing."""


@dataclass(frozen=True)
class RunOutcome(Stored[Payload], Generic[SuiteUnit, Payload]):
    """A run that has ended; units are missing if it was stopped.

    Attributes:
        close_failure: why the subject or the suite could not be closed; None if it was.
    """

    run: PreparedRun[SuiteUnit, Payload]
    close_failure: str | None = None

    @property
    def docs(self) -> Iterator[UnitDoc]:
        """The records in their order, as lm-eval's files have them, each made when it is read."""
        for record in self.records:
            yield self.run.evaluation.to_doc(self.summary.header, record)


def execute(
    run: PreparedRun[SuiteUnit, Payload],
    observer: Observer | None = None,
    should_stop: Callable[[], bool] = lambda: False,
    loaded: Subject | None = None,
) -> RunOutcome[SuiteUnit, Payload]:
    """Load the model, do what the journal does not hold yet, and write the results.

    The folder `<output>/<name>/<tasks>-<config hash>/` holds the journal, `run.yaml` (the options
    of the command), `results.json` (the summary) and `scores.jsonl` (of every unit), equal for
    equal runs, and `usage.json`.

    Args:
        run: the prepared run.
        observer: follows the run.
        should_stop: called after each unit; once it returns True, the units in hand are finished,
            and the results so far are written.
        loaded: the subject, if it is loaded; it is not closed.

    Raises:
        UsageError: another process at the same run, a subject that the suite cannot evaluate, or
            nothing to do.
        ModelError: the model cannot be loaded.
        DataError: the journal has a bad line, or the results cannot be written.
    """
    observer = observer or Silent()
    executor = _start_executor(run, observer.notify, loaded)
    try:
        stored = _evaluate(run, executor, observer, should_stop)
    except BaseException:
        with suppress(UserCodeError):  # what ended the run is told, not what failed after it
            executor.close()
        raise
    failure = None
    try:
        executor.close()
    except UserCodeError as error:  # all results are there
        failure = str(error)
    return RunOutcome(**vars(stored), run=run, close_failure=failure)


def _evaluate(
    run: PreparedRun[SuiteUnit, Payload],
    executor: Executor[Payload],
    observer: Observer,
    should_stop: Callable[[], bool],
) -> Stored[Payload]:
    header = executor.header
    workload = executor.workload
    folder = run.request.folder(header)
    if run.request.fresh:
        journals.set_aside(folder)
    n_recovered = journals.recover(folder, header, run.suite.records) if run.request.recover else 0
    with Journal(folder, header, run.suite.records) as journal:
        write_command(folder, run.request)
        observer.begin(workload, n_recovered)
        try:
            for record, resumed in executor.evaluate(folder, journal, should_stop):
                observer.done(record, resumed)
        except Exception:
            raise
        # Stopped at once: the units that are done have their results all the same.
        except BaseException:
            _store_results(run, folder, workload, journal)
            raise
        return _store_results(run, folder, workload, journal)


def _start_executor(
    run: PreparedRun[SuiteUnit, Payload], notify: Callable[[str], None], loaded: Subject | None
) -> Executor[Payload]:
    if run.request.worker_settings.is_local:
        return LocalExecutor(run, notify, loaded)
    return WorkerPoolExecutor(run, notify)


def _store_results(
    run: PreparedRun[SuiteUnit, Payload],
    folder: Path,
    workload: Workload[Unit[Any]],
    journal: Journal[Payload],
) -> Stored[Payload]:
    """Write the results of the units in the journal."""
    # The journal may hold more.
    keys = {unit.key for group in workload.groups for unit in group.units}
    records = [record for record in journal.records if record.key in keys]
    journal.check_file()
    return store_results(folder, run.suite, journal, records, workload.n_units - len(records))
