"""Tables of all runs: costs, and what was left out."""

from collections.abc import Iterator, Sequence

from infthor_eval.reasons import count_reasons
from infthor_eval.run import Run
from infthor_eval.runs import TaskConfig
from infthor_eval.tables import Column, Row, Table

_NAMES = (Column("run", False), Column("task", False))
_MEASURABLE_S = 0.05  # less is the clock's noise: baselines take microseconds


def costs_table(runs: Sequence[Run]) -> Table:
    """Return speed and cost, with a row per run."""
    tokens = ("tokens read", "of them cached, %", "tokens written")
    columns = ("samples", "seconds", "samples / s", "requests", *tokens, "cost")
    note = (
        "Seconds are the samples' own, added up: several workers take less by the clock. Cost is "
        "in US dollars."
    )
    return Table(
        "", (Column("run", False), *map(Column, columns)), tuple(map(_cost_row, runs)), (note,)
    )


def _cost_row(run: Run) -> Row:
    seconds = sum(record.seconds for record in run.records)
    rate = f"{len(run.records) / seconds:,.2f}" if seconds >= _MEASURABLE_S else "-"
    usage = run.usage
    requests = f"{usage.requests:,}"
    tokens = ("-", "-", "-")  # where nobody counts them
    if usage.hit_rate is not None:
        tokens = (f"{usage.context:,}", f"{100 * usage.hit_rate:.1f}", f"{usage.reply:,}")
    cost = "-" if usage.cost is None else f"{usage.cost:.4f}"
    return Row((run.label, str(len(run.records)), f"{seconds:.1f}", rate, requests, *tokens, cost))


def left_out_table(runs: Sequence[Run]) -> Table | None:
    """Return counts of failed, excluded, retried, skipped and missing units by reason, or None."""
    rows = [
        Row((run.label, task, what, str(n), reason))
        for run in runs
        for (task, what), reason, n in count_reasons(_left_out(run))
    ]
    why = "the run was stopped; the same command continues it"
    rows += [
        Row((run.label, "", "not asked", str(run.n_missing), why)) for run in runs if run.n_missing
    ]
    if not rows:
        return None
    columns = (*_NAMES, Column("what", False), Column("samples"), Column("reason", False))
    return Table("", columns, tuple(rows))


def _left_out(run: Run) -> Iterator[tuple[tuple[str, str], str]]:
    for record in run.records:
        if record.failure is not None:
            yield (record.task, record.state), record.failure
        if record.excluded is not None:
            yield (record.task, "excluded"), record.excluded
        for fault in record.faults:
            yield (record.task, "retried"), fault
    for name, task in run.tasks.items():
        for reason in task.skip_reasons if isinstance(task, TaskConfig) else ():
            yield (name, "skipped"), reason
