"""The table of runs and their chart: a row for each run and task."""

from collections.abc import Sequence

from infthor_eval.report.charts import Chart, Class, Point, Series, point_of
from infthor_eval.report.headline.results import TaskResult
from infthor_eval.tables import Column, Row, Table, answered_cell, interval_cell

_MOST_ROWS = 24  # of the chart; the table has all


def results_table(results: Sequence[TaskResult]) -> Table:
    """Return the score of each run and task, with what `blind` scores and what it cost."""
    names = ("run", "task", "measure")
    numbers = ("%", "95 % interval", "blind, %", "samples", "tokens", "seconds", "cost, $")
    columns = (*(Column(name, False) for name in names), *map(Column, numbers))
    note = "blind: what is had without a frame, on the same samples. tokens and "
    note += "seconds: read for a sample, and spent on it, on average. cost: of all samples."
    return Table("", columns, tuple(map(_row, results)), (note,))


def _row(result: TaskResult) -> Row:
    rate = result.rate
    low = high = None
    if rate is not None:
        low, high = (None if end is None else 100 * end for end in (rate.low, rate.high))
    mean = "" if rate is None else f"{100 * rate.mean:.1f}"
    n_answered = 0 if rate is None else rate.n
    n_all = result.n_all if rate is None else rate.n_all or rate.n
    cells = (
        *(result.run, result.task, result.measure),
        answered_cell(mean, n_answered, n_all) if mean or n_all else "-",
        interval_cell(low, high, pattern="{}–{}"),
        "-" if result.chance is None else f"{100 * result.chance:.1f}",
        f"{n_all:,}",
        "-" if result.n_tokens is None else f"{result.n_tokens:,.0f}",
        "-" if result.seconds is None else f"{result.seconds:,.2f}",
        "-" if result.cost is None else f"{result.cost:.4f}",
    )
    return Row(cells, link=result.link)


def results_chart(results: Sequence[TaskResult]) -> Chart | None:
    """Draw the score of each run and task with its interval; None if none has a score."""
    shown = sorted(results, key=lambda one: -(one.rate.mean if one.rate else -1.0))
    kept = set(map(id, shown[:_MOST_ROWS]))
    rows: list[Class] = []
    points = []
    heading = ""
    tasks = list(dict.fromkeys(one.task for one in results))
    by_task = sorted(results, key=lambda one: tasks.index(one.task))
    for result in by_task:
        if id(result) not in kept:
            continue
        words = f"{result.task}: {result.measure}"
        if result.rate is not None:
            points.append(point_of(len(rows), result.rate, result.rate.n))
        chance = None if result.chance is None else 100 * result.chance
        rows.append(Class(result.run, words if words != heading else "", chance))
        heading = words
    if not points:
        return None
    few = "" if len(rows) == len(results) else f" The {len(rows)} highest of {len(results)}."
    dashed = "; the dashed line is blind" if any(row.chance is not None for row in rows) else ""
    caption = (
        "Further right is better: a dot is a run's score, its line the 95 % interval over "
        f"trajectories{dashed}.{few}"
    )
    axes = ("run", "%, higher is better")
    return Chart("Results", caption, axes, (Series("score", points),), classes=rows)


def cost_chart(results: Sequence[TaskResult]) -> Chart | None:
    """Draw scores against what they cost: dollars if all runs have them, else tokens, else
    seconds; None with fewer than two runs of one task that have both."""
    scored = [result for result in results if result.rate is not None]
    costs = {
        "cost of a sample ($)": [one.cost and one.cost / max(one.n_all, 1) for one in scored],
        "tokens read for a sample": [one.n_tokens for one in scored],
        "seconds of a sample": [one.seconds for one in scored],
    }
    for axis, values in costs.items():
        points: dict[str, Point] = {}
        for one, value in zip(scored, values, strict=True):
            if value and one.rate is not None:
                points[f"{one.run}, {one.task}"] = point_of(value, one.rate, one.rate.n)
        if len(points) > 1 and (all(values) or axis.startswith("seconds")):
            caption = (
                "Up and to the left is better: each mark is a run, its line the 95 % interval; "
                "costs are on a log scale."
            )
            series = [Series(name, [points[name]], place) for place, name in enumerate(points)]
            return Chart("Score against cost", caption, (axis, "score (%)"), series, "log")
    return None
