"""The one number of each run and task that says most, with its interval; and what runs took and left out."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

from infthor_eval.agents.summary import PlansSummary
from infthor_eval.manipulation.summary import ManipulationSummary
from infthor_eval.nieh.summary import NiehSummary
from infthor_eval.rates import Rate
from infthor_eval.report.web.nieh_charts import MAIN_METRIC
from infthor_eval.report.web.runs import ReportRun
from infthor_eval.tables import Column, Row, Table

__all__ = ["headline_table", "left_out_table", "took_table"]

_NAMES = (Column("run", False), Column("task", False))


def headline_table(runs: Sequence[ReportRun]) -> Table:
    """A row per run and task."""
    rows = [Row((run.label, *cells)) for run in runs for cells in _headlines(run)]
    columns = (*_NAMES, Column("measure", False), *map(Column, ("%", "95 % interval", "units", "trajectories")))
    return Table("", columns, tuple(rows))


def _headlines(run: ReportRun) -> Iterator[tuple[str, ...]]:
    found = run.summary.summary
    if isinstance(found, NiehSummary):
        for name, task in found.tasks.items():
            score = task.by_clues["total"].scores.get(MAIN_METRIC)
            if score is not None:
                rate = Rate(score.mean, score.low, score.high, task.n)
                yield name, f"accuracy, {MAIN_METRIC}", *_cells(rate), str(task.n), str(score.n_trajectories)
    elif isinstance(found, PlansSummary):
        for name, plans in found.tasks.items():
            yield name, "reward, of what was to be had", *_cells(plans.reward_share), *_sizes(plans)
            yield name, "plans carried out", *_cells(plans.success.get("total")), *_sizes(plans)
    elif isinstance(found, ManipulationSummary):
        for name, arm in found.tasks.items():
            n = str(arm.success.n) if arm.success else "0"
            yield name, f"success, radius {arm.radius:g} m", *_cells(arm.success), n, str(arm.n_trajectories)


def _sizes(task: Any) -> tuple[str, str]:
    return str(task.n_plans), str(task.n_trajectories)


def _cells(rate: Rate | None) -> tuple[str, str]:
    if rate is None:
        return "-", "-"
    interval = "-" if rate.low is None or rate.high is None else f"{100 * rate.low:.1f}–{100 * rate.high:.1f}"
    return f"{100 * rate.mean:.1f}", interval


def took_table(runs: Sequence[ReportRun]) -> Table:
    """Speed and cost: a row per run."""
    columns = (
        "units",
        "seconds",
        "units / s",
        "requests",
        "tokens read",
        "of them cached, %",
        "tokens written",
        "cost",
    )
    note = "Seconds are the units' own, added up: several workers take less by the clock. Cost is in US dollars."
    return Table("", (Column("run", False), *map(Column, columns)), tuple(map(_took, runs)), (note,))


def _took(run: ReportRun) -> Row:
    seconds = sum(record.seconds for record in run.records)
    rate = f"{len(run.records) / seconds:.2f}" if seconds else "-"
    hit_rate = run.took.get("hit_rate")
    cached = "-" if hit_rate is None else f"{100 * hit_rate:.1f}"
    counts = (_count(run.took.get("requests")), _count(run.took.get("read")), cached, _count(run.took.get("written")))
    cost = run.took.get("cost")
    return Row(
        (run.label, str(len(run.records)), f"{seconds:.1f}", rate, *counts, "-" if cost is None else f"{cost:.4f}")
    )


def _count(value: int | None) -> str:
    return "-" if value is None else f"{value:,}"


def left_out_table(runs: Sequence[ReportRun]) -> Table | None:
    """What failed, was left out, was skipped or was not come to, by reason; None where all is well."""
    rows = [
        Row((run.label, task, what, str(n), reason))
        for run in runs
        for (task, what, reason), n in sorted(Counter(_left_out(run)).items())
    ]
    rows += [
        Row((run.label, "", "not come to", str(run.n_missing), "the run was stopped; the same command goes on"))
        for run in runs
        if run.n_missing
    ]
    if not rows:
        return None
    columns = (*_NAMES, Column("what", False), Column("units"), Column("reason", False))
    return Table("", columns, tuple(rows))


def _left_out(run: ReportRun) -> Iterator[tuple[str, str, str]]:
    for record in run.records:
        if record.failure is not None:
            yield record.task, "failed", record.failure
        if record.excluded is not None:
            yield record.task, "left out", record.excluded
        for fault in record.faults:
            yield record.task, "survived", fault
    for task, about in run.tasks.items():
        for item in about.get("skipped", ()):
            yield task, "skipped", item["reason"]
        for _, reason in about.get("broken", ()):
            yield task, "skipped", reason
