"""Results on plans as tables: success beside the published rows, rewards, and how plans ended."""

from collections.abc import Iterator, Sequence

from infthor_eval.formats.published import published_tables
from infthor_eval.plans.summary import FINAL_COLUMNS, PlansSummary, TaskSummary
from infthor_eval.rates import format_number, format_percent
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table, left_out_notes

__all__ = ["overview", "tables"]

_NAMES = (Column("model", False), Column("task", False))
_EMBEDDED = (
    "Made in the embedded simulator: not comparable with the published rows, which are of AI2-THOR's own trajectories."
)


def overview(runs: Sequence[RunSummary]) -> list[Table]:
    """Plans carried out and reward in one number a task."""
    rows = [
        Row(
            (
                name,
                task_name,
                format_percent(task.success.get("total")),
                format_percent(task.reward_share),
                *_sizes(task)[:2],
            )
        )
        for name, task_name, task in _tasks(runs)
    ]
    columns = (*_NAMES, *map(Column, ("carried out, %", "reward, % of the most", "plans", "trajectories")))
    return [Table("Plans, 95 % interval in brackets", columns, tuple(rows), tuple(_notes(runs)))]


def tables(runs: Sequence[RunSummary]) -> list[Table]:
    """The tables of some runs."""
    return [_success_table(runs), _reward_table(runs), _endings_table(runs)]


def _tasks(runs: Sequence[RunSummary]) -> Iterator[tuple[str, str, TaskSummary]]:
    """Run's name, task's name and the task, of all runs."""
    for run in runs:
        assert isinstance(run.summary, PlansSummary)
        frames = run.header.config["frames"]
        name = run.header.name if frames == "shown" else f"{run.header.name}, {frames} frames"
        for task_name, task in run.summary.tasks.items():
            yield name, task_name, task


def _success_table(runs: Sequence[RunSummary]) -> Table:
    """Plans carried out, by the columns of the published table of final tasks."""
    rows = [
        Row((name, task_name, *(format_percent(task.success.get(column)) for column in FINAL_COLUMNS), *_sizes(task)))
        for name, task_name, task in _tasks(runs)
    ]
    notes = _notes(runs)
    if any(_is_final(run) for run in runs):
        for table in published_tables("plans"):
            for row in table.rows:
                values = (f"{value:.1f}" for value in row.values)
                rows.append(Row((row.name, f"published, {table.title}", *values), is_published=True))
    columns = (*_NAMES, *map(Column, (*FINAL_COLUMNS, "plans", "trajectories", "excluded", "skipped", "failed")))
    return Table("Plans carried out, %", columns, tuple(rows), tuple(notes))


def _reward_table(runs: Sequence[RunSummary]) -> Table:
    rows = []
    for name, task_name, task in _tasks(runs):
        of_trajectory = format_number(task.reward), format_number(task.max_reward), format_percent(task.reward_share)
        rows.append(Row((name, task_name, *of_trajectory, format_percent(task.goals))))
    columns = (*_NAMES, *map(Column, ("reward", "at most", "% of it", "goals reached, %")))
    return Table("Reward of a trajectory, 95 % interval in brackets", columns, tuple(rows))


def _endings_table(runs: Sequence[RunSummary]) -> Table:
    """How plans ended: faults of replies among it."""
    found = list(_tasks(runs))
    endings = list(dict.fromkeys(ending for _, _, task in found for ending in task.endings))
    rows = [
        Row((name, task_name, *(str(task.endings.get(ending, 0)) for ending in endings), str(task.n_actions)))
        for name, task_name, task in found
    ]
    return Table("How plans ended", (*_NAMES, *map(Column, (*endings, "actions"))), tuple(rows))


def _sizes(task: TaskSummary) -> tuple[str, ...]:
    counts = (task.n_plans, task.n_trajectories, sum(task.excluded.values()), sum(task.skipped.values()), task.n_failed)
    return tuple(map(str, counts))


def _notes(runs: Sequence[RunSummary]) -> list[str]:
    notes = [_EMBEDDED] if any(run.summary.simulator == "embedded" for run in runs) else []
    return notes + left_out_notes([[(t.excluded, t.skipped) for t in run.summary.tasks.values()] for run in runs])


def _is_final(run: RunSummary) -> bool:
    tasks = run.header.config["tasks"].values()
    return any(task["config"]["dataset_kwargs"].get("plans") == "final" for task in tasks)
