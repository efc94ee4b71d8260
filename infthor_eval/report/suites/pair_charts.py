"""Charts of pairs of twins: the memory curves, net pairs by distance, frames shown and age."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from infthor_eval.errors import UsageError
from infthor_eval.facets import Facet
from infthor_eval.nieh.results.pair_summary import MEMORY_FACETS, PairSummary, TwinRecords
from infthor_eval.nieh.results.pair_tables import pair_tables
from infthor_eval.rates import Rate, format_percent
from infthor_eval.report.figures.style import (
    LEGEND,
    Look,
    add_legend,
    add_words,
    looks_of,
)
from infthor_eval.report.presenter import FigureRequest, FigureResult
from infthor_eval.report.svg.dots import DotsChart, class_row, dot_of, dots_chart, number_range
from infthor_eval.report.svg.drawing import Series
from infthor_eval.report.web.sections import Chart, Section
from infthor_eval.run import Run
from infthor_eval.tables import Column, Row, Table

# inches
_PANEL = (4.6, 2.6)
_MARGIN = 0.8
_SPREAD = 0.3  # share of a class's width that the points of several runs are spread over


class _Line(NamedTuple):
    """Pairs of a run in a task."""

    label: str
    pairs: PairSummary
    look: Look
    place: int

    @property
    def series(self) -> Series:
        return Series(self.label, self.place)


def pairs_section(runs: Sequence[Run]) -> Section | None:
    """Return the section of the page on pairs; None if the runs have none."""
    tables = pair_tables([run.summary for run in runs])
    if not tables:
        return None
    return Section("pairs", "Pairs of twins", tuple(_charts(runs)), tuple(tables))


def _charts(runs: Sequence[Run]) -> Iterator[Chart]:
    """Yield a chart per task and memory curve that has several classes."""
    for task in _tasks(runs):
        lines = _lines(runs, task)
        for curve in MEMORY_FACETS:
            names = _classes(curve, lines)
            if len(names) > 1:
                yield _chart(task, curve, names, lines)


def build_pairs_figure(runs: Sequence[Run], request: FigureRequest) -> FigureResult:
    """Return the memory curves of a task as one figure, a panel each.

    Raises:
        UsageError: the runs have no pairs, or none in the task, or several tasks have some.
    """
    tasks = _tasks(runs)
    if request.task is None and len(tasks) > 1:
        raise UsageError(f"--figure pairs: give --task, one of {', '.join(tasks)}")
    task = request.task or next(iter(tasks), "")
    if task not in tasks:
        raise UsageError(
            f"--figure pairs: {task or 'no task'} of these runs has pairs of twins; give a run of "
            "nieh_twins"
        )
    lines = _lines(runs, task)
    return FigureResult(_table(task, lines), lambda: _pairs_figure(task, lines))


def _tasks(runs: Sequence[Run]) -> list[str]:
    """Return the tasks with pairs."""
    by_name = ((name, task) for run in runs for name, task in run.summary.summary.tasks.items())
    return list(dict.fromkeys(name for name, task in by_name if task.pairs is not None))


def _lines(runs: Sequence[Run], task: str) -> list[_Line]:
    looks = looks_of(run.label for run in runs)
    summaries = [(run.label, run.summary.summary.tasks.get(task)) for run in runs]
    return [
        _Line(label, summary.pairs, looks[label], place)
        for place, (label, summary) in enumerate(summaries)
        if summary is not None and summary.pairs is not None
    ]


def _classes(curve: Facet[TwinRecords], lines: Sequence[_Line]) -> list[str]:
    """Return the curve's classes that a run has pairs in."""
    return curve.in_order(name for line in lines for name in line.pairs.by[curve.name])


def _chart(
    task: str, curve: Facet[TwinRecords], names: Sequence[str], lines: Sequence[_Line]
) -> Chart:
    rates = [line.pairs.by[curve.name] for line in lines]
    described = []
    for line, of_line in zip(lines, rates, strict=True):
        texts = [f"{100 * of_line[name].mean:.1f} % at {name}" for name in names if name in of_line]
        described.append(f"{line.label} {', '.join(texts)}")
    rows = []
    for name in names:
        known = [of_line.get(name) for of_line in rates]
        dots = [None if rate is None else dot_of(rate, rate.n) for rate in known]
        rows.append(class_row(name, dots))
    return dots_chart(
        DotsChart(
            title=f"{task}: net pairs of twins, by {curve.heading}",
            caption=(
                "A row is a class of pairs, with their number in parentheses; a dot is a run, its "
                "line the 95 % interval; 0 on average if the worlds cannot be told apart."
            ),
            axis="net pairs (%)",
            label=curve.heading,
            series=[line.series for line in lines],
            rows=rows,
            description="; ".join(described),
        )
    )


def _draw(
    axes: Axes, curve: Facet[TwinRecords], names: Sequence[str], lines: Sequence[_Line]
) -> None:
    """Draw a curve of each run over the classes, with intervals, and the counts of pairs."""
    rates = [line.pairs.by[curve.name] for line in lines]
    for number, (line, of_line) in enumerate(zip(lines, rates, strict=True)):
        offset = _SPREAD * (number / max(len(lines) - 1, 1) - 0.5) if len(lines) > 1 else 0.0
        _draw_line(axes, of_line, names, line.look, offset)
    counts = [number_range([of[name].n for of in rates if name in of]) for name in names]
    axes.set_xticks(
        range(len(names)), [f"{name}\n({n})" for name, n in zip(names, counts, strict=True)]
    )
    axes.set_ylim(min(-3.0, axes.get_ylim()[0]), 103)
    axes.set_ylabel("net pairs (%)")
    axes.set_xlabel(f"{curve.heading} (pairs)")
    axes.grid(axis="x", visible=False)


def _draw_line(
    axes: Axes, rates: Mapping[str, Rate], names: Sequence[str], look: Look, offset: float
) -> None:
    known = [(at + offset, rates[name]) for at, name in enumerate(names) if name in rates]
    means = [100 * rate.mean for _, rate in known]
    places = [place for place, _ in known]
    axes.plot(
        places, means, color=look.colour, ls=look.style, lw=look.width, marker="o", ms=4, zorder=3
    )
    for place, rate in known:
        if rate.low is not None and rate.high is not None:
            axes.vlines(
                place, 100 * rate.low, 100 * rate.high, color=look.colour, lw=1.2, zorder=2.8
            )


def _pairs_figure(task: str, lines: Sequence[_Line]) -> Figure:
    """Return a figure with a panel per curve."""
    width = len(MEMORY_FACETS) * _PANEL[0] + LEGEND
    figure = Figure(figsize=(width, _PANEL[1] + _MARGIN), layout="constrained")
    panels = figure.subplots(1, len(MEMORY_FACETS), squeeze=False)[0]
    for axes, curve in zip(panels, MEMORY_FACETS, strict=True):
        _draw(axes, curve, _classes(curve, lines), lines)
    add_legend(panels[-1], [(line.label, line.look) for line in lines])
    first = lines[0].pairs
    heading = (
        f"Net pairs of twins on {task}: {first.n_pairs} pairs of {first.n_trajectories} "
        "trajectories, with 95 % bootstrap intervals over trajectories"
    )
    add_words(figure, [heading], [f"In parentheses: pairs of {lines[0].label}."], width)
    return figure


def _table(task: str, lines: Sequence[_Line]) -> Table:
    """Return the numbers of the figure, a row per run, curve and class."""
    rows = []
    for line in lines:
        for curve in MEMORY_FACETS:
            for name, rate in line.pairs.by[curve.name].items():
                cells = (line.label, curve.heading, name, format_percent(rate), str(rate.n))
                rows.append(Row(cells))
    names = (Column("run", False), Column("by", False), Column("class", False))
    columns = (*names, Column("net pairs, %"), Column("pairs"))
    return Table(f"{task}: net pairs of twins", columns, tuple(rows))
