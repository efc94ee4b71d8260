"""`infthor-eval run`: evaluate a model on tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.run import RunOptions, run_options
from infthor_eval.cli.options.show import ShowOptions, parse_trackers, show_options, tracker_options
from infthor_eval.cli.options.values import WholeNumber
from infthor_eval.cli.progress.notes import (
    NOTES,
    print_failure,
    print_note,
    prints_as_notes,
    quiet_notes,
)
from infthor_eval.cli.progress.runs import check_others, execute_runs
from infthor_eval.cli.progress.undrawn import draw_missing
from infthor_eval.cli.results import print_failures, print_results
from infthor_eval.errors import DataError
from infthor_eval.reasons import count_reasons
from infthor_eval.run import Run
from infthor_eval.runs import (
    Equality,
    RunOutcome,
    RunRequest,
    Suite,
    check_equality,
    prepare_all,
    require_switches,
)
from model_adapters import model_note

if TYPE_CHECKING:
    from infthor_eval.harness.trackers import Trackers


@example_command(
    "run", "infthor-eval run --model oracle,blind,qwen2.5-vl-nano --tasks nieh_mini_gt"
)
@run_options
@show_options
@tracker_options
@click.option(
    "--check-equality",
    "n_checked",
    type=WholeNumber(1),
    metavar="N",
    help="First ask N of each task with and without the engine's switches in --model-args "
    "(docs/engines.md); a run whose switches change a reply is not started.",
)
@click.option("--quiet", is_flag=True, help="Print only failures, and the runs' folders.")
def command(n_checked: int | None, **params: Any) -> int:
    """Evaluate MODEL on TASKS and print the results; --full prints all, beside the published ones.

    Stop it whenever you like: the same command continues where it stopped.
    """
    requests = RunOptions.from_click(params).requests()
    show = ShowOptions.from_click(params)
    if n_checked is not None and not _are_equal(requests, n_checked, show.quiet):
        return 1
    return evaluate(requests, show, parse_trackers(params))


def _are_equal(requests: Sequence[tuple[RunRequest, Suite]], n_units: int, quiet: bool) -> bool:
    """Try the switches of all runs; print what they change, and return whether that is nothing."""
    for request, _ in requests:  # before any of them is loaded
        require_switches(request, n_units)
    n_changing = 0
    with quiet_notes(quiet):
        check_others(prepare_all(requests))
        for request, suite in requests:
            with NOTES.status(f"{request.label}: asking with and without its switches"):
                equality = check_equality(request, suite, n_units)
            if equality.n_differing:
                print_failure(f"{request.label}: {_difference(equality)}")
                n_changing += 1
            else:
                replies = f"{equality.n_units} replies are equal"
                print_note(f"{request.label}: {replies} with and without {_typed(equality)}")
    return n_changing == 0


def _typed(equality: Equality) -> str:
    return ",".join(f"{name}={value}" for name, value in equality.switched.items())


def _difference(equality: Equality) -> str:
    known = [f"{name}={equality.switched[name]} alone: {n}" for name, n in equality.alone.items()]
    if equality.n_unstable:
        known.append(f"without it, asked again: {equality.n_unstable}")
    more = f" ({', '.join(known)})" if known else ""
    return (
        f"{equality.n_differing} of {equality.n_units} replies differ with {_typed(equality)}"
        f"{more}; not started: leave it out, or leave out "
        "--check-equality to accept that"
    )


def evaluate(
    requests: Sequence[tuple[RunRequest, Suite]],
    show: ShowOptions,
    trackers: Mapping[str, Mapping[str, str]] | None = None,
) -> int:
    """Execute runs one after another, and print their results.

    Args:
        requests: the runs, each with its suite.
        show: how results are printed.
        trackers: arguments of the trackers that finished runs are sent to (see `Trackers`); None
            for none.

    Returns:
        Exit code: 130 where a run was stopped, 2 where a model's code failed after its units, 1
        where a unit failed, all units of a run were excluded, or a tracker refused a run, else 0.
    """
    from infthor_eval.exports.lm_eval import export
    from infthor_eval.harness.trackers import Trackers

    senders = Trackers(**(trackers or {}))
    with quiet_notes(show.quiet):
        draw_missing(requests)
        # Retrieval embeds every frame, which takes minutes.
        with NOTES.status("reading the tasks and their data"), prints_as_notes():
            runs = prepare_all(requests)
        for model in dict.fromkeys(request.model for request, _ in requests):
            if note := model_note(model):
                print_note(f"{model}: {note}", "yellow")
        outcomes, is_stopped = execute_runs(runs, finish=export)
    print_results([Run.just_stored(outcome, outcome.run.suite) for outcome in outcomes], show)
    with quiet_notes(show.quiet):
        for outcome in outcomes:
            _print_faults(outcome)
    # Every run prints its failures.
    n_failed = sum(print_failures(outcome.records) for outcome in outcomes)
    n_void = sum(map(_print_if_void, outcomes))
    n_unsent = sum(not _send(outcome, senders) for outcome in outcomes if not outcome.n_missing)
    close_failures = [outcome.close_failure for outcome in outcomes if outcome.close_failure]
    for failure in close_failures:
        print_failure(failure)
    if is_stopped:
        return 130
    return 2 if close_failures else int(n_failed + n_void + n_unsent > 0)


def _print_if_void(outcome: RunOutcome) -> bool:
    states = {record.state for record in outcome.records}
    is_void = bool(states) and "answered" not in states
    if is_void:
        why = " or ".join(sorted(states))
        print_failure(f"{outcome.summary.header.name}: no result: every sample is {why}")
    return is_void


def _send(outcome: RunOutcome, trackers: Trackers) -> bool:
    try:
        trackers.send(outcome)
    except DataError as error:
        print_failure(str(error))
        return False
    return True


def _print_faults(outcome: RunOutcome) -> None:
    """Print the faults that a run got over, such as the 429 of a busy server."""
    faults = [(record.task, fault) for record in outcome.records for fault in record.faults]
    for task, reason, n in count_reasons(faults):
        print_note(f"{task}: {n} fault(s): {reason}", "yellow")
