"""What people see of a run while it goes, on standard error."""

import contextlib
from collections.abc import Iterator
from typing import Any

from rich.progress import Progress

from infthor_eval.cli.progress.bar import PacedBar
from infthor_eval.cli.progress.stopping import Stop, stopped_by_sigint
from infthor_eval.reasons import count_reasons
from infthor_eval.runs import PreparedRun, RunOutcome, UnitRecord, Workload, execute
from infthor_eval.terminal import error_console, progress_bar

__all__ = ["NOTES", "complain", "execute_with_progress", "hushed", "say"]

NOTES = error_console()


class _Watcher:
    """Observes a run: what is skipped and what it costs beforehand, then how fast it goes."""

    def __init__(self, name: str, progress: Progress, stop: Stop) -> None:
        self._name = name
        self._progress = progress
        self._stop = stop

    def begin(self, workload: Workload, n_recovered: int) -> None:
        """See `Observer`."""
        if n_recovered:
            say(f"{self._name}: {n_recovered} bad line(s) of the journal set aside; those units are tried again")
        for task, reason, n in count_reasons((item.key.task, item.reason) for item in workload.skipped):
            say(f"{task}: {n} sample(s) skipped: {reason}", "yellow")
        for cost in workload.costs:
            say(f"{cost.task}: {cost.description}")
        self.bar = PacedBar(self._progress, self._name, workload.n_units)
        self._stop.begun = True

    def done(self, record: UnitRecord[Any], resumed: bool) -> None:
        """See `Observer`."""
        self.bar.advance(resumed, usage=record.usage)

    def note(self, text: str) -> None:
        """See `Observer`."""
        say(f"{self._name}: {text}", "yellow")


def execute_with_progress(run: PreparedRun) -> RunOutcome:
    """Execute one prepared run, with a bar, or lines where there is no terminal, and with what is skipped."""
    with progress_bar(NOTES) as progress, stopped_by_sigint(say) as stop:
        watcher = _Watcher(run.request.label, progress, stop)
        outcome = execute(run, watcher, stop)
    pace = watcher.bar.pace
    say(f"{run.request.label}: {pace.n_made} answered now, {pace.n_found} found in the journal of an earlier run")
    if outcome.n_missing:
        say(f"{run.request.label}: stopped, {outcome.n_missing} not come to; the same command goes on", "yellow")
    return outcome


@contextlib.contextmanager
def hushed(quiet: bool) -> Iterator[None]:
    """Where it is to be quiet, nothing is said but what is complained of."""
    NOTES.quiet = quiet
    try:
        yield
    finally:
        NOTES.quiet = False


def say(text: str, style: str = "") -> None:
    """A line on standard error; whatever is in it is shown as text."""
    NOTES.print(text, style=style)


def complain(text: str) -> None:
    """A line of what went wrong, said even where it is to be quiet."""
    error_console().print(text, style="red")
