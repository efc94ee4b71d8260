"""Charts of pairs of twins: the memory curves, net pairs by distance, frames shown and age."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

from infthor_eval.errors import UsageError
from infthor_eval.facets import Facet
from infthor_eval.nieh.results.pair_summary import MEMORY_FACETS, PairSummary, TwinRecords
from infthor_eval.rates import format_percent
from infthor_eval.report.charts import Chart, Panels, class_series, counted_classes
from infthor_eval.report.presenter import FigureRequest, FigureResult
from infthor_eval.run import Run
from infthor_eval.tables import Column, Row, Table


class _Line(NamedTuple):
    """Pairs of a run in a task."""

    label: str
    place: int
    pairs: PairSummary


def memory_curves(runs: Sequence[Run]) -> tuple[Chart, ...]:
    """Return the memory curves of the tasks with pairs that have several classes of these."""
    charts = [chart for task in _tasks(runs) for chart in _charts(task, _lines(runs, task))]
    return tuple(chart for chart in charts if len(chart.classes) > 1)


def build_pairs_figure(runs: Sequence[Run], request: FigureRequest) -> FigureResult:
    """Return the memory curves of a task as one figure, a panel each."""
    tasks = _tasks(runs)
    if request.task is None and len(tasks) > 1:
        raise UsageError(f"--figure pairs: give --task, one of {', '.join(tasks)}")
    task = request.task or next(iter(tasks), "")
    if task not in tasks:
        raise UsageError(
            f"--figure pairs: {task or 'no task'} of these runs has pairs of twins; give a run of "
            "nieh_twins"
        )
    # Loads matplotlib, which the page does without.
    from infthor_eval.report.figures import draw_figure

    lines = _lines(runs, task)
    first = lines[0].pairs
    heading = (
        f"Net pairs of twins on {task}: {first.n_pairs} pairs of {first.n_trajectories} "
        "trajectories, with 95 % bootstrap intervals over trajectories"
    )
    panels = Panels("", [line.label for line in lines], _charts(task, lines))
    columns = [""] * len(panels.charts)
    notes = ["In parentheses: the number of pairs."]
    plot = partial(draw_figure, [heading], columns, [panels], notes)
    return FigureResult(_table(task, lines), plot)


def _tasks(runs: Sequence[Run]) -> list[str]:
    """Return the tasks with pairs."""
    by_name = ((name, task) for run in runs for name, task in run.summary.summary.tasks.items())
    return list(dict.fromkeys(name for name, task in by_name if task.pairs is not None))


def _lines(runs: Sequence[Run], task: str) -> list[_Line]:
    summaries = [(run.label, run.summary.summary.tasks.get(task)) for run in runs]
    return [
        _Line(label, place, summary.pairs)
        for place, (label, summary) in enumerate(summaries)
        if summary is not None and summary.pairs is not None
    ]


def _charts(task: str, lines: Sequence[_Line]) -> list[Chart]:
    return [_chart(task, curve, lines) for curve in MEMORY_FACETS]


def _chart(task: str, curve: Facet[TwinRecords], lines: Sequence[_Line]) -> Chart:
    """Return the chart of a memory curve, over the classes that a run has pairs in."""
    names = curve.in_order(name for line in lines for name in line.pairs.by[curve.name])
    described = []
    series = []
    for label, place, pairs in lines:
        rates = pairs.by[curve.name]
        series.append(class_series(label, place, names, rates))
        texts = [f"{100 * rates[name].mean:.1f} % at {name}" for name in names if name in rates]
        described.append(f"{label} {', '.join(texts)}")
    return Chart(
        title=f"{task}: net pairs of twins, by {curve.heading}",
        caption=(
            "A row is a class of pairs, with their number in parentheses; a dot is a run, its "
            "line the 95 % interval; 0 on average if the worlds cannot be told apart."
        ),
        axes=(curve.heading, "net pairs (%)"),
        series=series,
        classes=counted_classes(names, series),
        words="; ".join(described),
    )


def _table(task: str, lines: Sequence[_Line]) -> Table:
    """Return the numbers of the figure, a row per run, curve and class."""
    rows = []
    for label, _, pairs in lines:
        for curve in MEMORY_FACETS:
            for name, rate in pairs.by[curve.name].items():
                cells = (label, curve.heading, name, format_percent(rate), str(rate.n))
                rows.append(Row(cells))
    names = (Column("run", False), Column("by", False), Column("class", False))
    columns = (*names, Column("net pairs, %"), Column("pairs"))
    return Table(f"{task}: net pairs of twins", columns, tuple(rows))
