"""Who does a run's work: this process, or several workers; either way the same records."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

from infthor_eval.runs.groups import group_records
from infthor_eval.runs.identity import header_of
from infthor_eval.runs.journal import Journal
from infthor_eval.runs.records import RunHeader, UnitRecord
from infthor_eval.runs.request import PreparedRun
from infthor_eval.runs.scheduling import run_groups
from infthor_eval.runs.session import JournalSession
from infthor_eval.runs.subjects import subject_of
from infthor_eval.runs.suite import UnitSample, Workload

__all__ = ["Executor", "LocalExecutor", "Recorded", "View"]

Recorded = tuple[UnitRecord[Any], bool]  # one that is on disk; and whether an earlier run had put it there
View = Callable[[UnitRecord[Any]], UnitSample]


class Executor(Protocol):
    """Who does the work."""

    def begin(self) -> tuple[RunHeader, Workload]:
        """Get ready: who the run is, and all that there is to do."""
        ...

    def evaluate(self, folder: Path, journal: Journal, should_stop: Callable[[], bool]) -> Iterator[Recorded]:
        """Do all groups; every record as soon as it is on disk.

        Args:
            folder: the run's.
            journal: the driver's shard.
            should_stop: once it says so, the units in hand are the last.
        """
        ...

    def view(self, records: Sequence[UnitRecord[Any]]) -> View:
        """How other readers see these records; it may be called after `close`."""
        ...

    def close(self) -> None:
        """Let go of everything, whatever was reached."""
        ...


class LocalExecutor:
    """This process."""

    def __init__(self, run: PreparedRun) -> None:
        """Load the subject.

        Raises:
            UsageError: the suite cannot evaluate it.
            ModelError: it cannot be loaded.
        """
        self._run = run
        self.evaluation = run.evaluation
        self.subject = subject_of(run)

    def begin(self) -> tuple[RunHeader, Workload]:
        """See `Executor`."""
        self._workload = self.evaluation.workload(self.subject)
        return header_of(self._run, self.subject, self._workload), self._workload

    def evaluate(self, folder: Path, journal: Journal, should_stop: Callable[[], bool]) -> Iterator[Recorded]:
        """See `Executor`."""
        session = JournalSession(self.subject, journal)
        evaluation, in_flight = self.evaluation, self.subject.capabilities.max_in_flight
        for record in run_groups(
            self._workload.groups, lambda group: group_records(evaluation, group, session), in_flight
        ):
            yield session.recorded(record)
            if should_stop():
                return

    def view(self, records: Sequence[UnitRecord[Any]]) -> View:
        """See `Executor`."""
        return self.evaluation.view

    def close(self) -> None:
        """See `Executor`."""
        self.evaluation.close()
        self.subject.close()
