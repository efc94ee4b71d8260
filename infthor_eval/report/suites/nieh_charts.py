"""Charts of NIEH: accuracy by clues, type, evidence and depth, and gains."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from infthor_eval.distances import DISTANCES, LENGTHS
from infthor_eval.formats.question import ABSENCE
from infthor_eval.nieh.results.above_blind import AboveBlind, FormScore
from infthor_eval.nieh.results.cells import Cell, mean_cell
from infthor_eval.nieh.results.evidence_tables import short_name
from infthor_eval.nieh.results.gains import find_gains, name_of
from infthor_eval.nieh.results.summary import (
    CLUE_COLUMNS,
    SHOWN_CLUES,
    TaskSummary,
    main_metric,
)
from infthor_eval.report.suites.memory_chart import memory_charts
from infthor_eval.report.svg.dots import Dot, DotRow, DotsChart, class_row, dot_of, dots_chart
from infthor_eval.report.svg.drawing import Series
from infthor_eval.report.web.sections import Chart
from infthor_eval.run import Run
from infthor_eval.statistics import MeanEstimate
from infthor_eval.tables import Column, Row, Table

_COLUMNS = (*CLUE_COLUMNS, ABSENCE)
_DEPTH = "depth="


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
    yield _by_class(
        _Classes(task, "number of clues", clues, lambda line: line.task.by_clues), lines
    )
    types = sorted({name for line in lines for name in line.task.by_question_type})
    if len(types) > 1:
        yield _by_class(
            _Classes(task, "type of question", types, lambda line: line.task.by_question_type),
            lines,
        )
    if any(len(_forms(line)) > 1 for line in lines):
        yield _by_form(task, lines)
    variants = sorted({name for line in lines for name in line.task.by_variant})
    depths = [name for name in variants if name.startswith(_DEPTH)]
    if len(depths) > 1:
        yield _by_class(
            _Classes(task, "depth of the needle", depths, lambda line: line.task.by_variant), lines
        )
    known_lengths = set().union(*(line.task.by_length for line in lines))
    lengths = [name for name in LENGTHS if name in known_lengths]
    if len(lengths) > 1:
        classes = _Classes(task, "length of the context, thousand tokens", lengths, _by_length)
        yield _by_class(classes, lines)
    yield from _by_evidence(task, lines)


@dataclass(frozen=True)
class _Classes:
    """Classes of a task's questions: what they are by, their names, and their cells of a run."""

    task: str
    by: str
    names: Sequence[str]
    cells_of: Callable[[_Line], Mapping[str, Cell]]


def _by_length(line: _Line) -> Mapping[str, Cell]:
    return {name: length.cell for name, length in line.task.by_length.items()}


def _by_evidence(task: str, lines: Sequence[_Line]) -> Iterator[Chart]:
    """Draw accuracy by share of the clues shown and by distance of the last clue; by file."""
    for file in lines[0].task.evidence:
        of_file = f"{task}, {short_name(file)}" if len(lines[0].task.evidence) > 1 else task

        def cells_by_share(line: _Line, file: str = file) -> Mapping[str, Cell]:
            return line.task.evidence[file].by_shown_clues if file in line.task.evidence else {}

        def far(line: _Line, file: str = file) -> Mapping[str, Cell]:
            return line.task.evidence[file].by_distance if file in line.task.evidence else {}

        if any(cells_by_share(line).keys() - {"all"} for line in lines):
            by = "clue frames shown"
            yield _by_class(_Classes(of_file, by, SHOWN_CLUES, cells_by_share), lines)
        known = set().union(*map(far, lines))
        distances = [name for name in DISTANCES if name in known]
        if len(distances) > 1 and any(line.task.context != "clues" for line in lines):
            by = "frames between the last clue and the end"
            yield _by_class(_Classes(of_file, by, distances, far), lines)


def _by_class(classes: _Classes, lines: Sequence[_Line]) -> Chart:
    """Draw a row per class with the dots of all lines."""
    cells = [classes.cells_of(line) for line in lines]
    rows = []
    for name in classes.names:
        dots = [_dot(of_line.get(name), line) for of_line, line in zip(cells, lines, strict=True)]
        rows.append(class_row(name.removeprefix(_DEPTH), dots))
    return dots_chart(
        DotsChart(
            title=f"{classes.task}: accuracy by {classes.by}",
            caption=(
                "A row is a class of questions, with their number in parentheses; a dot is a run, "
                "its line the 95 % interval over trajectories."
            ),
            axis=f"{lines[0].metric} (%)",
            label=classes.by,
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
        if any(variant.startswith(_DEPTH) for variant in task.by_variant):
            tasks[int(run.tasks[name].dataset_kwargs.get("ctx_size") or 0)] = task
    if not tasks:
        return None
    sizes = sorted(tasks)
    metric = main_metric(next(iter(tasks.values())))
    depths = sorted(
        {depth for task in tasks.values() for depth in task.by_variant if depth.startswith(_DEPTH)}
    )
    means = []
    for depth in depths:
        means.append([_percent(tasks[size].by_variant.get(depth), metric) for size in sizes])

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
        axes.set_yticks(range(len(depths)), [depth.removeprefix(_DEPTH) for depth in depths])
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
        rows.append(Row((depth.removeprefix(_DEPTH), *cells)))
    return Table("", columns, tuple(rows))


def _size(size: int) -> str:
    return f"{size}K" if size else "all"


def _percent(cell: Cell | None, metric: str) -> float:
    score = None if cell is None else cell.scores.get(metric)
    return math.nan if score is None else 100 * score.mean
