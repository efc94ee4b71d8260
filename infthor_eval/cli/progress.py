"""What people see of a run while it goes, on standard error."""

from typing import Any

from rich.progress import Progress

from infthor_eval.cli.reasons import counted_reasons
from infthor_eval.cli.stopping import Stop, stopped_by_sigint
from infthor_eval.runs import PreparedRun, RunOutcome, UnitRecord, Workload, execute
from infthor_eval.terminal import error_console, progress_bar

__all__ = ["NOTES", "execute_with_progress", "say"]

NOTES = error_console()


class _Bar:
    """Observes a run: what is skipped and what it costs beforehand, then a bar."""

    def __init__(self, name: str, progress: Progress, stop: Stop) -> None:
        self._name = name
        self._progress = progress
        self._stop = stop
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
        self._stop.begun = True

    def done(self, record: UnitRecord[Any], resumed: bool) -> None:
        """See `Observer`."""
        self.n_found, self.n_made = self.n_found + resumed, self.n_made + (not resumed)
        self._progress.advance(self._bar)

    def note(self, text: str) -> None:
        """See `Observer`."""
        say(f"{self._name}: {text}", "yellow")


def execute_with_progress(run: PreparedRun) -> RunOutcome:
    """Execute one prepared run, with a progress bar, and with what is skipped and what failed."""
    with progress_bar(NOTES) as progress, stopped_by_sigint(say) as stop:
        bar = _Bar(run.request.label, progress, stop)
        outcome = execute(run, bar, stop)
    say(f"{run.request.label}: {bar.n_made} answered now, {bar.n_found} found in the journal of an earlier run")
    if outcome.n_missing:
        say(f"{run.request.label}: stopped, {outcome.n_missing} not come to; the same command goes on", "yellow")
    return outcome


def say(text: str, style: str = "") -> None:
    """A line on standard error; whatever is in it is shown as text."""
    NOTES.print(text, style=style)
