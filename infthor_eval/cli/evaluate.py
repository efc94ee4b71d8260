"""What `run` does with its requests, and what of it people see."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from infthor_eval.cli.options import table_console
from infthor_eval.report import answers_table, depth_table, nieh_table, summarise
from infthor_eval.runs import Budget, Observer, Plan, RunOutcome, RunRequest, UnitRecord, execute, plan
from model_adapters import check_options

__all__ = ["evaluate", "execute_with_progress"]

_notes = Console(stderr=True, soft_wrap=True)
_output = table_console()


def evaluate(requests: Sequence[RunRequest]) -> int:
    """Run the requests one after another and print one table.

    Returns:
        Exit code: 1 where a question failed, else 0.
    """
    for request in requests:
        check_options(request.model, request.model_options)  # refused before the data are read
    with _notes.status("looking at the questions and their frames"):  # retrieval embeds every frame: minutes
        plans = [plan(request) for request in requests]
    summaries, outcomes = [], []
    for ready in plans:
        outcome = execute_with_progress(ready)
        summary = summarise(outcome.identity, outcome.records)
        _write_json(outcome.folder / "results.json", summary)
        outcomes.append(outcome)
        summaries.append(summary)
    for table in (depth_table(summaries), nieh_table(summaries), answers_table(summaries)):
        if table is not None:
            _output.print(table)
    for outcome in outcomes:
        _output.print(f"{outcome.identity['model']['name']}: {outcome.folder}", highlight=False)
    return int(any(_say_what_failed(outcome) for outcome in outcomes))


def execute_with_progress(plan: Plan) -> RunOutcome:
    """Execute one planned run, with a progress bar and what is left out on standard error."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    found = made = 0
    with Progress(*columns, console=_notes, transient=True) as progress:

        def begin(ready: Plan, budgets: list[Budget]) -> Observer:
            _say_what_is_left_out(ready)
            _say_what_it_costs(budgets)
            bar = progress.add_task(ready.request.model, total=ready.n_units)

            def observe(_: UnitRecord, resumed: bool) -> None:
                nonlocal found, made
                found, made = found + resumed, made + (not resumed)
                progress.advance(bar)

            return observe

        outcome = execute(plan, begin)
    _notes.print(
        f"{plan.request.model}: {made} answered now, {found} found in the journal of an earlier run", highlight=False
    )
    return outcome


def _say_what_is_left_out(ready: Plan) -> None:
    for task in ready.tasks:
        for reason, n in sorted(Counter(item.reason for item in task.resolved.left_out).items()):
            _notes.print(f"{task.name}: {n} question(s) left out: {reason}", style="yellow", highlight=False)


def _say_what_it_costs(budgets: list[Budget]) -> None:
    for budget in budgets:
        limit = "no limit" if budget.limit is None else f"limit {budget.limit:,}"
        limit += "" if budget.limit_before is None else f", {budget.limit_before:,} before its extension"
        _notes.print(
            f"{budget.task}: {budget.n_contexts} contexts, the longest request {budget.longest:,} tokens ({limit}): "
            f"{budget.outcome}",
            highlight=False,
        )


def _say_what_failed(outcome: RunOutcome) -> int:
    reasons = Counter((r.task, r.failure) for r in outcome.records if r.failure is not None)
    for (task, reason), n in sorted(reasons.items()):
        _notes.print(f"{task}: {n} question(s) failed, counted as wrong: {reason}", style="red", highlight=False)
    return sum(reasons.values())


def _write_json(path: Path, value: dict[str, Any]) -> None:
    partial = path.with_name(path.name + ".partial")
    partial.write_bytes(msgspec.json.format(msgspec.json.encode(value, order="sorted"), indent=2) + b"\n")
    partial.replace(path)
