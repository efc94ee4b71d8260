"""`infthor-eval run`: evaluate a model on tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.cli.options.run import run_options
from infthor_eval.cli.options.trackers import TRACKERS, tracker_options
from infthor_eval.cli.progress.progress import NOTES, complain, execute_with_progress, hushed
from infthor_eval.cli.showing import SHOWING, Showing, ShownRun, show, showing_options
from infthor_eval.errors import DataError
from infthor_eval.reasons import count_reasons
from infthor_eval.runs import RunOutcome, RunRequest, Suite, prepare

if TYPE_CHECKING:
    from infthor_eval.harness.trackers import Trackers

__all__ = ["command", "evaluate"]


@click.command("run")
@run_options(*SHOWING, *TRACKERS)
@showing_options
@tracker_options
@click.option("--quiet", is_flag=True, help="Say nothing but what failed; print the runs' folders alone.")
def command(requests: Any, showing: Showing, trackers: Any) -> int:
    """Evaluate MODEL on TASKS and print the results; --full prints all of them, beside the published ones.

    Stop it whenever you like: the same command goes on where it was.
    """
    return evaluate(requests, showing, trackers)


def evaluate(
    requests: Sequence[tuple[RunRequest, Suite]],
    showing: Showing,
    trackers: Mapping[str, Mapping[str, str]] | None = None,
) -> int:
    """Run the requests one after another, and print what they found.

    Args:
        requests: the runs, each with its suite.
        showing: how results are shown.
        trackers: arguments of those that finished runs are sent to (see `Trackers`); None for none.

    Returns:
        Exit code: 130 where somebody stopped it, 1 where a unit failed, nothing of a run counts, or a tracker did not
        take one, else 0.
    """
    from infthor_eval.harness.trackers import Trackers

    sending = Trackers(**(trackers or {}))
    with hushed(showing.quiet):
        outcomes = _executed(requests)
    show([_shown(outcome) for outcome in outcomes], showing)
    n_failed = sum(map(_say_what_failed, outcomes))  # every run says what failed
    n_void = sum(map(_say_if_void, outcomes))
    n_unsent = sum(_say_what_is_unsent(outcome, sending) for outcome in outcomes if not outcome.n_missing)
    return 130 if outcomes[-1].n_missing else int(n_failed + n_void + n_unsent > 0)


def _executed(requests: Sequence[tuple[RunRequest, Suite]]) -> list[RunOutcome]:
    """All runs, or those up to the one that somebody stopped."""
    from infthor_eval.harness.export import export

    with NOTES.status("looking at the tasks and their data"):  # retrieval embeds every frame: minutes
        runs = [prepare(request, suite) for request, suite in requests]
    outcomes = []
    for run in runs:
        outcomes.append(execute_with_progress(run))
        export(outcomes[-1])
        if outcomes[-1].n_missing:
            break
    return outcomes


def _shown(outcome: RunOutcome) -> ShownRun:
    return ShownRun(outcome.folder, outcome.run.suite, outcome.summary, outcome.usage, outcome.n_missing)


def _say_if_void(outcome: RunOutcome) -> bool:
    void = bool(outcome.records) and all(record.excluded is not None for record in outcome.records)
    if void:
        complain(f"{outcome.summary.header.name}: nothing that could be evaluated counts: all of it was left out")
    return void


def _say_what_is_unsent(outcome: RunOutcome, trackers: Trackers) -> bool:
    try:
        trackers.send(outcome)
    except DataError as error:
        complain(str(error))
        return True
    return False


def _say_what_failed(outcome: RunOutcome) -> int:
    failed = [(record.task, record.failure) for record in outcome.records if record.failure is not None]
    for task, reason, n in count_reasons(failed):
        complain(f"{task}: {n} sample(s) failed, counted as wrong: {reason}")
    return len(failed)
