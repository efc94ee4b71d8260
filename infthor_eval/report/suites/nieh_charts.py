"""Charts of NIEH: accuracy by clues, type, evidence and depth, and gains."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import NamedTuple

from infthor_eval.formats.question import ABSENCE
from infthor_eval.nieh.results.above_blind import AboveBlind, FormScore
from infthor_eval.nieh.results.cells import Cell, mean_cell
from infthor_eval.nieh.results.evidence_tables import facet_cells, short_name
from infthor_eval.nieh.results.facets import DEPTH, FACETS, QuestionFacet
from infthor_eval.nieh.results.gains import find_gains, name_of
from infthor_eval.nieh.results.summary import (
    CLUE_COLUMNS,
    TaskSummary,
    main_metric,
)
from infthor_eval.nieh.results.tables import by_depth
from infthor_eval.report.suites.memory_chart import memory_charts
from infthor_eval.report.svg.dots import Dot, DotRow, DotsChart, class_row, dot_of, dots_chart
from infthor_eval.report.svg.drawing import Series
from infthor_eval.report.web.sections import Chart
from infthor_eval.run import Run
from infthor_eval.statistics import MeanEstimate
from infthor_eval.tables import Column, Row, Table

_COLUMNS = (*CLUE_COLUMNS, ABSENCE)


class _Line(NamedTuple):
    """Results of a run on a task."""

    series: Series
    task: TaskSummary

    @property
    def metric(self) -> str:
        return main_metric(self.task)


def nieh_charts(runs: Sequence[Run]) -> list[Chart]:
    """Draw all charts that the runs have numbers for."""
    charts: list[Chart] = []
    for task in dict.fromkeys(name for run in runs for name in run.summary.summary.tasks):
        lines = [
            _Line(Series(run.label, place), run.summary.summary.tasks[task])
            for place, run in enumerate(runs)
            if task in run.summary.summary.tasks and run.summary.summary.tasks[task].n
        ]
        if lines:
            charts += _charts_of_task(task, lines)
    summaries = [_gains_chart(runs), _above_blind_chart(runs)]
    heat_maps = [_heat_map(run) for run in runs]
    drawn = [chart for chart in (*summaries, *heat_maps) if chart is not None]
    return [*charts, *memory_charts(runs), *drawn]


def _charts_of_task(task: str, lines: Sequence[_Line]) -> Iterator[Chart]:
    clues = [name for name in _COLUMNS if any(line.task.by_clues[name].n for line in lines)]
    by_clues = [line.task.by_clues for line in lines]
    yield _by_class(task, "number of clues", clues, by_clues, lines)
    facets = {facet.name: facet for facet in FACETS if facet.in_charts}
    yield from _by_facet(task, facets.pop("question_type"), lines)
    if any(len(_forms(line)) > 1 for line in lines):
        yield _by_form(task, lines)
    by_depths = [by_depth(line.task) for line in lines]
    depths = sorted(set().union(*by_depths))
    if len(depths) > 1:
        yield _by_class(task, "depth of the needle", depths, by_depths, lines)
    for facet in facets.values():
        if not facet.of_files:
            yield from _by_facet(task, facet, lines)
    files = ["total", *lines[0].task.files]
    for file, facet in product(files, facets.values()):
        if facet.of_files:
            name = f"{task}, {short_name(file)}" if len(files) > 1 else task
            yield from _by_facet(name, facet, lines, file)


def _by_facet(
    title: str, facet: QuestionFacet, lines: Sequence[_Line], file: str = "total"
) -> Iterator[Chart]:
    """Draw the classes of a facet, if they tell anything of some run."""
    cells = [facet_cells(facet, line.task).get(file, {}) for line in lines]
    names = facet.shown(set().union(*cells))
    both = zip(lines, cells, strict=True)
    if len(names) > 1 and any(facet.is_worth(line.task.context, of) for line, of in both):
        yield _by_class(title, facet.heading, names, cells, lines)


def _by_class(
    task: str,
    by: str,
    names: Sequence[str],
    cells: Sequence[Mapping[str, Cell]],
    lines: Sequence[_Line],
) -> Chart:
    """Draw a row per class with the dots of all lines, whose cells are by class."""
    rows = []
    for name in names:
        dots = [_dot(of_line.get(name), line) for of_line, line in zip(cells, lines, strict=True)]
        rows.append(class_row(name.removeprefix(DEPTH), dots))
    return dots_chart(
        DotsChart(
            title=f"{task}: accuracy by {by}",
            caption=(
                "A row is a class of questions, with their number in parentheses; a dot is a run, "
                "its line the 95 % interval over trajectories."
            ),
            axis=f"{lines[0].metric} (%)",
            label=by,
            series=[line.series for line in lines],
            rows=rows,
            description=_describe(lines),
        )
    )


def _dot(cell: Cell | None, line: _Line) -> Dot | None:
    if cell is None or not cell.scores:
        return None
    return dot_of(cell.scores[line.metric], cell.n_answered)


def _forms(line: _Line) -> Mapping[str, FormScore]:
    above = line.task.above_blind.get(line.metric)
    return {} if above is None else above.forms


def _by_form(task: str, lines: Sequence[_Line]) -> Chart:
    """Draw a row per form of question, with what `blind` scores in it."""
    forms = [_forms(line) for line in lines]
    rows = []
    for name in sorted(set().union(*forms)):
        known = [of_line.get(name) for of_line in forms]
        first = next(form for form in known if form is not None)
        dots = [None if form is None else Dot(100 * form.score, n=form.n) for form in known]
        rows.append(class_row(name, dots, 100 * first.blind))
    return dots_chart(
        DotsChart(
            title=f"{task}: accuracy by form, beside blind",
            caption=(
                "A row is a form of question, with the number of those answered in parentheses: "
                "dots to the right of the dashed line know more than blind, which sees no frame."
            ),
            axis=f"{lines[0].metric} (%)",
            label="form",
            series=[line.series for line in lines],
            rows=rows,
            description=_describe(lines),
        )
    )


def _describe(lines: Sequence[_Line]) -> str:
    """Return the totals in words."""
    totals = ((line.series.name, mean_cell(line.task.total, line.metric, 1)) for line in lines)
    return "; ".join(f"{label} {mean} %" for label, mean in totals)


def _gains_chart(runs: Sequence[Run]) -> Chart | None:
    """Draw each run's gain over blank frames, a row per task; None without a run on blank ones."""
    summaries = [run.summary for run in runs]
    rows = []
    for gain in find_gains(summaries):
        total = gain.total()
        if gain.metric == main_metric(gain.seeing) and total is not None:
            rows.append((f"{name_of(gain.run)}, {gain.task}", total))
    caption = "Dots to the right of 0 gain by seeing the frames; lines are 95 % intervals."
    return _by_rows("Gain over blank frames", caption, rows, "gain, in points")


def _above_blind_chart(runs: Sequence[Run]) -> Chart | None:
    """Draw the score above blind of each run, a row per task; None if no floor is known."""
    rows = [
        (f"{run.label}, {name}", above)
        for run in runs
        for name, task in run.summary.summary.tasks.items()
        if (above := task.above_blind.get(main_metric(task))) is not None and above.mean is not None
    ]
    caption = "0 is blind, which sees no frame, 100 all right; lines are 95 % intervals."
    return _by_rows("Above blind", caption, rows, "% above blind")


def _by_rows(
    title: str, caption: str, rows: Sequence[tuple[str, MeanEstimate | AboveBlind]], axis: str
) -> Chart | None:
    """Draw a row with a dot for each value, around 0; None without rows."""
    if not rows:
        return None
    description = "; ".join(f"{name} {100 * (value.mean or 0):+.1f}" for name, value in rows)
    drawn = [DotRow(name, (dot_of(value),)) for name, value in rows]
    # Nothing at all would be drawn on a scale of hundredths.
    limits = (-5.0, 5.0)
    series = (Series("value"),)
    return dots_chart(
        DotsChart(
            title,
            caption,
            axis,
            "run and task",
            series,
            drawn,
            limits=limits,
            description=description,
        )
    )


def _heat_map(run: Run) -> Chart | None:
    """Draw accuracy by depth of the needle and context size; None if no task has depths."""
    from matplotlib.figure import Figure

    from infthor_eval.report.figures.style import inline_svg

    tasks: dict[int, TaskSummary] = {}
    for name, task in run.summary.summary.tasks.items():
        if by_depth(task):
            tasks[int(run.tasks[name].dataset_kwargs.get("ctx_size") or 0)] = task
    if not tasks:
        return None
    sizes = sorted(tasks)
    metric = main_metric(next(iter(tasks.values())))
    depths = sorted(set().union(*map(by_depth, tasks.values())))
    means = []
    for depth in depths:
        means.append([_percent(by_depth(tasks[size]).get(depth), metric) for size in sizes])

    def draw() -> Figure:
        figure = Figure(
            figsize=(2.2 + 0.9 * len(sizes), 1.4 + 0.5 * len(depths)), layout="constrained"
        )
        axes = figure.subplots()
        axes.grid(visible=False)
        # One hue: colour-blind readers and prints tell its values apart by lightness alone.
        picture = axes.imshow(means, cmap="Blues", vmin=0, vmax=100, aspect="auto")
        for row, values in enumerate(means):
            for column, value in enumerate(values):
                ink = "white" if value > 55 else "#222222"
                text = "-" if math.isnan(value) else f"{value:.0f}"
                axes.text(column, row, text, ha="center", va="center", color=ink)
        axes.set_xticks(range(len(sizes)), list(map(_size, sizes)))
        axes.set_yticks(range(len(depths)), [depth.removeprefix(DEPTH) for depth in depths])
        axes.set_xlabel("context (thousand tokens)")
        axes.set_ylabel("depth of the needle")
        figure.colorbar(picture, ax=axes, label=f"{metric} (%)")
        return figure

    return Chart(
        f"{run.label}: accuracy by depth and size of the context",
        inline_svg(draw),
        "see the table by depth",
        f"Darker is better: {metric} in percent, by where the needle is and how long the context.",
        _heat_table(depths, sizes, means),
    )


def _heat_table(
    depths: Sequence[str], sizes: Sequence[int], means: Sequence[Sequence[float]]
) -> Table:
    columns = (Column("depth", False), *(Column(_size(size)) for size in sizes))
    rows = []
    for depth, values in zip(depths, means, strict=True):
        cells = ("-" if math.isnan(value) else f"{value:.2f}" for value in values)
        rows.append(Row((depth.removeprefix(DEPTH), *cells)))
    return Table("", columns, tuple(rows))


def _size(size: int) -> str:
    return f"{size}K" if size else "all"


def _percent(cell: Cell | None, metric: str) -> float:
    score = None if cell is None else cell.scores.get(metric)
    return math.nan if score is None else 100 * score.mean
