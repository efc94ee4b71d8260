"""Results of plans as tables: success beside the published rows, rewards, and how plans ended."""

from collections.abc import Mapping, Sequence
from typing import Any

from infthor_eval.distances import DISTANCES, LENGTHS
from infthor_eval.episodes.tables import NAME_COLUMNS, endings_table, named_tasks, result_notes
from infthor_eval.formats.published import published_tables
from infthor_eval.plans.config import PlansTaskConfig
from infthor_eval.plans.summary import FINAL_COLUMNS, NEVER, PlanTaskSummary
from infthor_eval.rates import Rate, format_number, format_percent
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table

__all__ = ["overview_table", "result_tables"]

_PATH_WEIGHTED = "path-weighted"
_COUNTS = ("plans", "tried", "trajectories", "excluded", "skipped", "failed")
_NEVER = "*"  # marks published cells that cannot be other than 0
_AFTER_FAILURE = {
    "continue": "After a failed plan the next one is tried, as in the published script "
    "(--after-failure continue).",
    "stop": "After a failed plan the trajectory is over, as in the paper's Algorithm 2 "
    "(--after-failure stop).",
}
_PUBLISHED_RULES = (
    "Under the published rules 'at most' is the planner's reward, as walking to and fro earns "
    "without end. The logged totals are the script's, which leaves out the reward of an action "
    "that completes a plan."
)


def overview_table(runs: Sequence[RunSummary]) -> Table:
    """Return completed plans and reward, one number a task."""
    rows = [
        Row(
            (
                *names,
                format_percent(task.success.get("total")),
                format_percent(task.reward_share),
                *_sizes(task)[:3],
            )
        )
        for *names, task in named_tasks(runs)
    ]
    columns = (*NAME_COLUMNS, *map(Column, ("completed, %", "reward, % of the most", *_COUNTS[:3])))
    return Table("Plans, 95 % interval in brackets", columns, tuple(rows), result_notes(runs))


def result_tables(runs: Sequence[RunSummary]) -> list[Table]:
    """Return all tables of some runs."""
    tasks = list(named_tasks(runs))
    endings = endings_table("How plans ended", tasks, "actions", _actions)
    return [_success_table(runs, tasks), *_distance_tables(tasks), _reward_table(tasks), endings]


def _success_table(
    runs: Sequence[RunSummary], tasks: Sequence[tuple[str, str, PlanTaskSummary]]
) -> Table:
    """Return completed plans, by the columns of the published table of final tasks."""
    rows = [
        Row(
            (
                *names,
                *(format_percent(task.success.get(column)) for column in FINAL_COLUMNS),
                format_percent(task.path_weighted),
                *_sizes(task),
            )
        )
        for *names, task in tasks
    ]
    notes = [*result_notes(runs), *_conduct_notes(runs)]
    if any(_is_comparable(run) for run in runs):
        for table in published_tables("plans"):
            for row in table.rows:
                cells = zip(table.columns, row.values, strict=True)
                values = (f"{value:.1f}{_NEVER * (column == 'Put')}" for column, value in cells)
                rows.append(
                    Row((row.name, f"published, {table.title}", *values), is_published=True)
                )
            notes += (f"Published, {table.title}: {note}" for note in table.notes)
        notes.append(
            f"{_NEVER} Cannot be other than 0: the published script counts every put as failed."
        )
    elif any(_has_final_task(run) for run in runs):
        notes.append(
            "Published rows stand beside runs with --protocol published --rewards published alone."
        )
    columns = (*NAME_COLUMNS, *map(Column, (*FINAL_COLUMNS, _PATH_WEIGHTED, *_COUNTS)))
    return Table("Plans completed, %", columns, tuple(rows), tuple(notes))


def _distance_tables(tasks: Sequence[tuple[str, str, PlanTaskSummary]]) -> list[Table]:
    """Return the final tasks' plans by the distance of their clues: in frames, and in tokens if
    they are counted."""
    tables = []
    for title, of_task, order in (
        (
            "frames since what they need was in view",
            lambda task: task.by_distance,
            (*DISTANCES, NEVER),
        ),
        ("thousand tokens since then", lambda task: task.by_tokens, LENGTHS),
    ):
        names = [name for name in order if any(name in of_task(task) for *_, task in tasks)]
        rows = [
            Row((*run, *(_rate_and_n(of_task(task).get(name)) for name in names)))
            for *run, task in tasks
            if of_task(task)
        ]
        if rows:
            columns = (*NAME_COLUMNS, *map(Column, names))
            tables.append(
                Table(f"Final tasks: plans completed, % (plans), by {title}", columns, tuple(rows))
            )
    return tables


def _rate_and_n(rate: Rate | None) -> str:
    return "-" if rate is None else f"{format_percent(rate)} ({rate.n})"


def _conduct_notes(runs: Sequence[RunSummary]) -> list[str]:
    """Return how the runs went on after a failed plan; Algorithm 2 of the paper and its script
    differ in it."""
    ways = {task.after_failure for run in runs for task in run.header.config.tasks.values()}
    return [text for way, text in _AFTER_FAILURE.items() if way in ways]


def _reward_table(tasks: Sequence[tuple[str, str, PlanTaskSummary]]) -> Table:
    logged = [
        name
        for name in ("total_reward", "agent_reward")
        if any(name in task.logged for *_, task in tasks)
    ]
    rows = []
    for *names, task in tasks:
        of_trajectory = (
            format_number(task.reward),
            format_number(task.max_reward),
            format_percent(task.reward_share),
        )
        totals = (format_number(task.logged.get(name)) for name in logged)
        goals = format_percent(task.goals), format_percent(task.goal_conditions)
        rows.append(Row((*names, task.rules or "-", *of_trajectory, *goals, *totals)))
    of_log = (f"logged {name}" for name in logged)
    columns = (
        *NAME_COLUMNS,
        Column("rules", False),
        *map(
            Column,
            ("reward", "at most", "% of it", "goals reached, %", "goal conditions, %", *of_log),
        ),
    )
    notes = (_PUBLISHED_RULES,) if logged else ()
    return Table("Reward of a trajectory, 95 % interval in brackets", columns, tuple(rows), notes)


def _actions(task: PlanTaskSummary) -> str:
    return "-" if task.n_actions is None else str(task.n_actions)


def _sizes(task: PlanTaskSummary) -> tuple[str, ...]:
    tried = "-" if task.n_tried is None else task.n_tried
    others = (
        task.n_trajectories,
        sum(task.excluded.values()),
        sum(task.skipped.values()),
        task.n_failed,
    )
    return tuple(map(str, (task.n_plans, tried, *others)))


def _has_final_task(run: RunSummary) -> bool:
    tasks = run.header.config.tasks.values()
    return any(task.dataset_kwargs.get("plans") == "final" for task in tasks)


def _is_comparable(run: RunSummary) -> bool:
    """Return whether a run has a task that was run as the published final tasks were, or comes from
    their logs."""
    comparable = any(
        task.rewards is None or _is_published(task, task.rewards)
        for task in run.header.config.tasks.values()
    )
    return comparable and _has_final_task(run)


def _is_published(task: PlansTaskConfig, rewards: Mapping[str, Any]) -> bool:
    return task.protocol == "published" and rewards.get("scoring") == "published"
