"""One run of any suite: its journal, and the order of its work."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from infthor_eval.runs import journal as journals
from infthor_eval.runs.configuration import write_configuration
from infthor_eval.runs.executor import LocalExecutor, View
from infthor_eval.runs.journal import Journal
from infthor_eval.runs.records import RunHeader, UnitRecord
from infthor_eval.runs.request import PreparedRun
from infthor_eval.runs.results import results_document, write_results, write_scores, write_usage
from infthor_eval.runs.suite import RunSummary, Workload
from infthor_eval.runs.usage import Usage
from infthor_eval.runs.worker_executor import WorkerPoolExecutor

__all__ = ["Observer", "RunOutcome", "Silent", "execute"]


class Observer(Protocol):
    """Is told how a run goes."""

    def begin(self, workload: Workload, n_recovered: int) -> None:
        """All that will be done, before the first unit; and how many bad lines were taken out of the journal."""
        ...

    def done(self, record: UnitRecord[Any], resumed: bool) -> None:
        """A unit is done; or was found in the journal of an earlier, stopped run."""
        ...

    def note(self, text: str) -> None:
        """What became of a worker, in words."""
        ...


class Silent:
    """An observer that says nothing."""

    def begin(self, workload: Workload, n_recovered: int) -> None:
        """Nothing."""

    def done(self, record: UnitRecord[Any], resumed: bool) -> None:
        """Nothing."""

    def note(self, text: str) -> None:
        """Nothing."""


@dataclass(frozen=True)
class RunOutcome:
    """A run that has ended.

    Attributes:
        folder: the run's own.
        run: what it was made from.
        summary: who it was, and what it found.
        records: of every unit that was come to.
        n_missing: how many units were not come to, as the run was stopped.
        usage: what all its requests took, those for memos with them.
        view: how other readers see its records.
    """

    folder: Path
    run: PreparedRun
    summary: RunSummary
    records: list[UnitRecord[Any]]
    n_missing: int
    usage: Usage
    view: View


def execute(
    run: PreparedRun, observer: Observer | None = None, should_stop: Callable[[], bool] = lambda: False
) -> RunOutcome:
    """Load the model, do what the journal does not hold yet, and write the results.

    The folder `<output>/<name>/<tasks>-<identity>/` holds the journal, `run.yaml` (how it was asked for),
    `results.json` (what it found) and `scores.jsonl` (of every unit), equal for equal runs, and `usage.json` (what it
    took).

    Args:
        run: what `prepare` found.
        observer: is told how it goes.
        should_stop: once it says so, the units in hand are finished, and the results of what is there are written.

    Raises:
        UsageError: another process at the same run, a subject that the suite cannot evaluate, or nothing to do.
        ModelError: the model cannot be loaded.
        DataError: the journal has a bad line, or the results cannot be written.
    """
    observer = observer or Silent()
    executor = LocalExecutor(run) if run.request.worker_settings.is_local else WorkerPoolExecutor(run, observer.note)
    try:
        header, workload = executor.begin()
        folder = run.request.folder(header)
        n_recovered = _open_anew(run, folder, header)
        with Journal(folder, header, run.suite.records) as journal:
            write_configuration(folder, run.request)
            observer.begin(workload, n_recovered)
            try:
                for record, resumed in executor.evaluate(folder, journal, should_stop):
                    observer.done(record, resumed)
            except Exception:
                raise
            except BaseException:  # stopped at once: what is there by then has its results all the same
                _found(run, folder, header, workload, journal)
                raise
            outcome = _found(run, folder, header, workload, journal)
        return replace(outcome, view=executor.view(outcome.records))
    finally:
        executor.close()


def _found(run: PreparedRun, folder: Path, header: RunHeader, workload: Workload, journal: Journal) -> RunOutcome:
    """What the journal holds of a run by now, with its results written."""
    records = _asked(workload, journal)
    journal.require_there()
    summary = RunSummary(header, run.suite.summarise(header, records))
    n_missing = workload.n_units - len(records)
    usage = Usage.total([record.usage for record in records] + [memo.usage for memo in journal.memos])
    write_results(folder, results_document(summary, run.suite, n_missing, usage))
    write_scores(folder, run.suite, records)
    write_usage(folder, records, usage)
    return RunOutcome(folder, run, summary, records, n_missing, usage, run.evaluation.view)


def _open_anew(run: PreparedRun, folder: Path, header: RunHeader) -> int:
    """What --fresh and --recover do to an earlier journal; how many bad lines were taken out of it."""
    if run.request.fresh:
        journals.set_aside(folder)
    return journals.recover(folder, header, run.suite.records) if run.request.recover else 0


def _asked(workload: Workload, journal: Journal) -> list[UnitRecord[Any]]:
    """The records of what this run asks; the journal may know more."""
    asked = {unit.key for group in workload.groups for unit in group.units}
    return [record for record in journal.records if record.key in asked]
