"""Results of plans as tables: success beside the published rows, rewards, and how plans ended."""

from collections.abc import Sequence

from msgspec import UNSET

from infthor_eval.episodes.tables import NAME_COLUMNS, endings_table, named_tasks, result_notes
from infthor_eval.facets import facet_table
from infthor_eval.formats.published import PUBLISHED_DATA, published_tables
from infthor_eval.plans.summary import BY_DISTANCE, BY_TOKENS, FINAL_COLUMNS, PlanTaskSummary
from infthor_eval.rates import Rate, format_number, format_percent
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table

_PATH_WEIGHTED = "path-weighted"
_COUNTS = ("plans", "tried", "trajectories", "excluded", "skipped", "failed", "not asked")
_DRAW_NOTHING = {"baseline", "reader"}  # in the identities of baselines and of people
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
_NET_PAIRS = "net pairs, %"
_TWIN_COLUMNS = (
    _NET_PAIRS,
    "right, %",
    "exchanged, %",
    "both done, %",
    "worlds right, %",
    "one of two, %",
    "same place, %",
    "nowhere, %",
    "opened in vain",
    "excess actions",
    "pairs",
    "incomplete",
)
_TWIN_NOTE = (
    "A pair is right if the agent looks first where the object is, in both worlds, and exchanged "
    "if it looks first where the object is in the other world, in both. net pairs: right less "
    "exchanged, with the 95 % bootstrap interval over trajectories; 0 on average for an agent that "
    "does not know which world is which. Containers and actions are means of worlds."
)


def overview_table(runs: Sequence[RunSummary]) -> Table:
    """Return completed plans and reward, or pairs if there are twins, one number a task."""
    tasks = list(named_tasks(runs))
    has_twins = any(task.twins is not UNSET for *_, task in tasks)
    rows = []
    for *names, task in tasks:
        success = format_percent(task.success.get("total"), task.n_plans)
        pairs = None if task.twins is UNSET else task.twins.net_pairs
        second = format_percent(pairs if has_twins else task.reward_share)
        rows.append(Row((*names, success, second, *_sizes(task)[:3])))
    second_column = _NET_PAIRS if has_twins else "reward, % of the most"
    columns = (*NAME_COLUMNS, *map(Column, ("completed, %", second_column, *_COUNTS[:3])))
    notes = (*result_notes(runs), *_decoding_notes(runs))
    return Table("Plans, 95 % interval in brackets", columns, tuple(rows), notes)


def result_tables(runs: Sequence[RunSummary]) -> list[Table]:
    """Return all tables of some runs."""
    tasks = list(named_tasks(runs))
    endings = endings_table("How plans ended", tasks, "actions", _actions)
    return [
        *_twin_tables(tasks),
        _success_table(runs, tasks),
        *_distance_tables(tasks),
        _reward_table(tasks),
        endings,
    ]


def _success_table(
    runs: Sequence[RunSummary], tasks: Sequence[tuple[str, str, PlanTaskSummary]]
) -> Table:
    """Return completed plans, by the columns of the published table of final tasks."""
    rows = []
    for *names, task in tasks:
        success = [format_percent(task.success.get(column)) for column in FINAL_COLUMNS[:-1]]
        success.append(format_percent(task.success.get("total"), task.n_plans))
        rows.append(Row((*names, *success, format_percent(task.path_weighted), *_sizes(task))))
    notes = [*result_notes(runs), *_decoding_notes(runs), *_conduct_notes(runs)]
    if any(_is_comparable(run) for run in runs):
        for table in published_tables("plans"):
            for row in table.rows:
                cells = zip(table.columns, row.values, strict=True)
                values = (f"{value:.1f}{_NEVER * (column == 'Put')}" for column, value in cells)
                rows.append(
                    Row((row.name, f"published, {table.title}", *values), is_published=True)
                )
            notes += (f"Published, {table.title}: {note}" for note in table.notes)
        notes.append(PUBLISHED_DATA)
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
    """Return tables of final tasks' plans by the distance of their clues, in frames and tokens."""
    by_frames = [((run, name), task.by_distance) for run, name, task in tasks]
    by_tokens = [((run, name), task.by_tokens) for run, name, task in tasks]
    return [
        table
        for facet, named in ((BY_DISTANCE, by_frames), (BY_TOKENS, by_tokens))
        for table in facet_table(
            f"Final tasks: plans completed, % (plans), by {facet.heading}",
            [column.name for column in NAME_COLUMNS],
            facet.in_order(name for _, rates in named for name in rates),
            [(names, rates) for names, rates in named if rates],
            _rate_and_n,
        )
    ]


def _rate_and_n(rate: Rate | None) -> str:
    return "-" if rate is None else f"{format_percent(rate)} ({rate.n})"


def _conduct_notes(runs: Sequence[RunSummary]) -> list[str]:
    """Return how runs went on after a failed plan; the paper's Algorithm 2 and script differ."""
    ways = {task.after_failure for run in runs for task in run.header.config.tasks.values()}
    return [text for way, text in _AFTER_FAILURE.items() if way in ways]


def _decoding_notes(runs: Sequence[RunSummary]) -> list[str]:
    """Return whose actions were drawn: greedy ones can be right far more often."""
    drawn: dict[float, dict[str, None]] = {}  # names by temperature, each once and in order
    for run in runs:
        if _DRAW_NOTHING.isdisjoint(run.header.config.model):
            for task in run.header.config.tasks.values():
                names = drawn.setdefault(task.decoding.get("temperature", 0), {})
                names[run.header.label] = None
    return [
        f"Drawn at temperature {temperature:g}, not the likeliest actions (--greedy): "
        f"{', '.join(names)}."
        for temperature, names in drawn.items()
        if temperature
    ]


def _reward_table(tasks: Sequence[tuple[str, str, PlanTaskSummary]]) -> Table:
    known = {name for *_, task in tasks for name in task.logged}
    logged = [name for name in ("total_reward", "agent_reward") if name in known]
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
    numbers = ["reward", "at most", "% of it", "goals reached, %", "goal conditions, %"]
    numbers += [f"logged {name}" for name in logged]
    columns = (*NAME_COLUMNS, Column("rules", False), *map(Column, numbers))
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
        task.n_not_asked,
    )
    return tuple(map(str, (task.n_plans, tried, *others)))


def _has_final_task(run: RunSummary) -> bool:
    tasks = run.header.config.tasks.values()
    return any(task.dataset_kwargs.get("plans") == "final" for task in tasks)


def _is_comparable(run: RunSummary) -> bool:
    """Return whether a run has a task run as the published final tasks were, or from their logs."""
    comparable = any(
        task.rewards is None
        or (task.protocol == "published" and task.rewards.get("scoring") == "published")
        for task in run.header.config.tasks.values()
    )
    return comparable and _has_final_task(run)


def _twin_tables(tasks: Sequence[tuple[str, str, PlanTaskSummary]]) -> list[Table]:
    """Return the table of the tasks whose trajectories are twins; none without such a task."""
    rows = []
    for *names, task in tasks:
        twins = task.twins
        if twins is UNSET:
            continue
        shares = (
            twins.net_pairs,
            twins.pair_accuracy,
            twins.pairs_exchanged,
            twins.pair_success,
            twins.accuracy,
            twins.one_of_two,
            twins.same_place,
            twins.nowhere,
        )
        rows.append(
            Row(
                (
                    *names,
                    *map(format_percent, shares),
                    format_number(twins.opened),
                    format_number(twins.excess),
                    str(twins.n_pairs),
                    str(twins.n_incomplete),
                )
            )
        )
    columns = (*NAME_COLUMNS, *map(Column, _TWIN_COLUMNS))
    table = Table("Twins: the place looked at first", columns, tuple(rows), (_TWIN_NOTE,))
    return [table] if rows else []
