"""What people see of a run while it goes, on standard error."""

from typing import Any

from rich.progress import Progress

from infthor_eval.cli.reasons import counted_reasons
from infthor_eval.runs import PreparedRun, RunOutcome, UnitRecord, Workload, execute
from infthor_eval.terminal import error_console, progress_bar

__all__ = ["NOTES", "execute_with_progress", "say"]

NOTES = error_console()


class _Bar:
    """Observes a run: what is skipped and what it costs beforehand, then a bar."""

    def __init__(self, name: str, progress: Progress) -> None:
        self._name = name
        self._progress = progress
        self.n_found = self.n_made = 0

    def begin(self, workload: Workload, n_recovered: int) -> None:
        """See `Observer`."""
        if n_recovered:
            say(f"{self._name}: {n_recovered} bad line(s) of the journal set aside; those units are tried again")
        for task, reason, n in counted_reasons((item.key.task, item.reason) for item in workload.skipped):
            say(f"{task}: {n} sample(s) skipped: {reason}", "yellow")
        for cost in workload.costs:
            say(f"{cost.task}: {cost.description}")
        self._bar = self._progress.add_task(self._name, total=workload.n_units)

    def done(self, record: UnitRecord[Any], resumed: bool) -> None:
        """See `Observer`."""
        self.n_found, self.n_made = self.n_found + resumed, self.n_made + (not resumed)
        self._progress.advance(self._bar)


def execute_with_progress(run: PreparedRun) -> RunOutcome:
    """Execute one prepared run, with a progress bar, and with what is skipped and what failed."""
    with progress_bar(NOTES) as progress:
        bar = _Bar(run.request.label, progress)
        outcome = execute(run, bar)
    say(f"{run.request.label}: {bar.n_made} answered now, {bar.n_found} found in the journal of an earlier run")
    return outcome


def say(text: str, style: str = "") -> None:
    """A line on standard error; whatever is in it is shown as text."""
    NOTES.print(text, style=style)
