"""Progress of a run, on standard error."""

import time
from collections.abc import Callable, Sequence
from typing import Any

from rich.progress import Progress

from infthor_eval.cli.progress.bar import PacedBar
from infthor_eval.cli.progress.notes import NOTES, print_note, prints_as_notes
from infthor_eval.cli.progress.stopping import Stop, stop_on_sigint
from infthor_eval.reasons import count_reasons
from infthor_eval.runs import (
    PreparedRun,
    RunOutcome,
    SharedSubject,
    UnitRecord,
    Workload,
    check_runs,
    execute,
)
from infthor_eval.terminal import progress_bar
from model_adapters import Subject


class _ProgressObserver:
    """Prints what is skipped and what the run costs, then how fast it goes."""

    def __init__(self, name: str, progress: Progress, stop: Stop) -> None:
        self._name = name
        self._progress = progress
        self._stop = stop

    def begin(self, workload: Workload, n_recovered: int) -> None:
        if n_recovered:
            set_aside = f"{n_recovered} bad line(s) of the journal set aside"
            print_note(f"{self._name}: {set_aside}; those samples are tried again")
        print_workload(workload)
        self.bar = PacedBar(self._progress, self._name, workload.n_units)
        # Tasks differ, and a group's first unit may pay for all of it: whole groups tell how long
        # the others take.
        groups = workload.groups if len(workload.groups) > 1 else ()
        self._weights = {group.units[-1].key: len(group.units) + group.frames for group in groups}
        self._weight = 0  # of the groups done now
        self._weigh()
        self._stop.has_begun = True

    def done(self, record: UnitRecord[Any], resumed: bool) -> None:
        weight = self._weights.pop(record.key, None)
        if weight is not None:
            self._weight += 0 if resumed else weight
            self._weigh()
        self.bar.advance(resumed, context=record.usage.context, cached=record.usage.cached)

    def _weigh(self) -> None:
        if self._weights:
            self.bar.pace.weigh(self._weight, sum(self._weights.values()), time.monotonic())

    def notify(self, text: str) -> None:
        print_note(f"{self._name}: {text}", "yellow")


def print_workload(workload: Workload) -> None:
    """Print warnings, what is skipped, by reason, and what each task costs."""
    for warning in workload.warnings:
        print_note(warning, "yellow")
    skipped = [(unit.key.task, unit.reason) for unit in workload.skipped]
    for task, reason, n in count_reasons(skipped):
        print_note(f"{task}: {n} sample(s) skipped: {reason}", "yellow")
    for cost in workload.costs:
        print_note(f"{cost.task}: {cost.description}")


def check_others(runs: Sequence[PreparedRun]) -> None:
    """Have the runs after the first refuse what they cannot do."""
    with NOTES.status("checking all models"), prints_as_notes():
        check_runs(runs[1:])


def execute_runs(
    runs: Sequence[PreparedRun], finish: Callable[[RunOutcome], object] = lambda _: None
) -> tuple[list[RunOutcome], bool]:
    """Execute runs one after another, each with a bar on a terminal and lines elsewhere.

    What any of them refuses is told before the first begins.

    Args:
        runs: the runs.
        finish: called after each.

    Returns:
        The runs that were begun, and whether Ctrl-C left something undone: units of the last one,
        or the runs after it.
    """
    check_others(runs)
    outcomes: list[RunOutcome] = []
    with SharedSubject() as shared:
        for run in runs:
            outcome, is_requested = _execute(run, shared.of(run))
            outcomes.append(outcome)
            finish(outcome)
            if outcome.n_missing:
                return outcomes, True
            left = len(runs) - len(outcomes)
            if is_requested and left:
                print_note(
                    f"stopped, {left} run(s) not begun; run the same command to continue", "yellow"
                )
                return outcomes, True
    return outcomes, False


def _execute(run: PreparedRun, loaded: Subject | None) -> tuple[RunOutcome, bool]:
    """Execute a run, whose subject may be loaded; return whether Ctrl-C was pressed, too."""
    with progress_bar(NOTES) as progress, stop_on_sigint(print_note) as stop, prints_as_notes():
        observer = _ProgressObserver(run.request.label, progress, stop)
        outcome = execute(run, observer, stop, loaded)
    pace = observer.bar.pace
    print_note(
        f"{run.request.label}: {pace.n_new} evaluated now, {pace.n_resumed} resumed from the "
        "journal"
    )
    if outcome.n_missing:
        print_note(
            f"{run.request.label}: stopped, {outcome.n_missing} not attempted; run the same "
            "command to continue",
            "yellow",
        )
    return outcome, stop.is_requested
