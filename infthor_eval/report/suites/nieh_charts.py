"""Charts of NIEH: accuracy by clues, type, evidence and depth, gains over frames and guessing."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from infthor_eval.distances import DISTANCES
from infthor_eval.formats.question import ABSENCE
from infthor_eval.nieh.results.above_guessing import AboveGuessing
from infthor_eval.nieh.results.cells import Cell, Score, mean_cell
from infthor_eval.nieh.results.evidence_tables import short_name
from infthor_eval.nieh.results.gains import find_gains, name_of
from infthor_eval.nieh.results.summary import (
    CLUE_COLUMNS,
    SHOWN_CLUES,
    TaskSummary,
    main_metric,
)
from infthor_eval.report.figures.style import LEGEND, Look, add_legend, inline_svg, looks_of
from infthor_eval.report.runs import ReportRun
from infthor_eval.report.suites.memory_chart import memory_charts
from infthor_eval.report.web.sections import Chart
from infthor_eval.statistics import MeanEstimate
from infthor_eval.terminal import printable

__all__ = ["nieh_charts"]

_COLUMNS = (*CLUE_COLUMNS, ABSENCE)
_SPREAD = 0.6  # share of a column's width that the dots of several runs are spread over
# inches
_PANEL = (4.6, 2.6)
_ROW = 0.34
_DEPTH = "depth="
_GAIN = looks_of(("gain",))["gain"].colour


class _Line(NamedTuple):
    """Results of a run on a task."""

    label: str
    task: TaskSummary
    look: Look

    @property
    def metric(self) -> str:
        return main_metric(self.task)


def nieh_charts(runs: Sequence[ReportRun]) -> list[Chart]:
    """Draw all charts that the runs have numbers for."""
    looks = looks_of(run.label for run in runs)
    charts = []
    for task in dict.fromkeys(name for run in runs for name in run.summary.summary.tasks):
        lines = [
            _Line(run.label, run.summary.summary.tasks[task], looks[run.label])
            for run in runs
            if task in run.summary.summary.tasks and run.summary.summary.tasks[task].n
        ]
        if lines:
            charts += [_by_clues(task, lines), _by_type(task, lines), *_by_evidence(task, lines)]
    summaries = [_gains_chart(runs), _above_guessing_chart(runs)]
    heat_maps = [_heat_map(run) for run in runs]
    drawn = [chart for chart in (*summaries, *heat_maps) if chart is not None]
    return [*charts, *memory_charts(runs), *drawn]


def _by_clues(task: str, lines: Sequence[_Line]) -> Chart:
    title = f"{task}: accuracy by number of clues"
    return _by_columns(title, lines, _COLUMNS, lambda line: line.task.by_clues, "clues (questions)")


def _by_evidence(task: str, lines: Sequence[_Line]) -> Iterator[Chart]:
    """Draw accuracy by share of the clues shown and by distance of the last clue; by file."""
    for file in lines[0].task.evidence:
        of_file = f"{task}, {short_name(file)}" if len(lines[0].task.evidence) > 1 else task

        def cells_by_share(line: _Line, file: str = file) -> Mapping[str, Cell]:
            return line.task.evidence[file].by_shown_clues if file in line.task.evidence else {}

        def far(line: _Line, file: str = file) -> Mapping[str, Cell]:
            return line.task.evidence[file].by_distance if file in line.task.evidence else {}

        if any(cells_by_share(line).keys() - {"all"} for line in lines):
            title = f"{of_file}: accuracy by clue frames shown"
            yield _by_columns(
                title,
                lines,
                SHOWN_CLUES,
                cells_by_share,
                "of the clue frames were shown (questions)",
            )
        known = set().union(*map(far, lines))
        distances = [name for name in DISTANCES if name in known]
        if len(distances) > 1 and any(line.task.context != "clues" for line in lines):
            title = f"{of_file}: accuracy by distance of the last clue from the end"
            yield _by_columns(
                title, lines, distances, far, "frames after the last clue (questions)"
            )


def _by_columns(
    title: str,
    lines: Sequence[_Line],
    names: Sequence[str],
    cells_of: Callable[[_Line], Mapping[str, Cell]],
    label: str,
) -> Chart:
    """Draw a column per name, with the dots of all lines and the counts of the first."""

    def draw() -> Figure:
        figure = Figure(figsize=(_PANEL[0] + LEGEND, _PANEL[1]), layout="constrained")
        axes = figure.subplots()
        for number, line in enumerate(lines):
            cells = cells_of(line)
            _dots(axes, [cells.get(name) for name in names], line, _offset(number, len(lines)))
        first = cells_of(lines[0])
        counts = [first[name].n if name in first else 0 for name in names]
        axes.set_xticks(
            range(len(names)), [f"{name}\n({n})" for name, n in zip(names, counts, strict=True)]
        )
        axes.set_ylim(-3, 103)
        axes.set_ylabel(f"{lines[0].metric} (%)")
        axes.set_xlabel(label)
        axes.grid(axis="x", visible=False)
        add_legend(axes, [(line.label, line.look) for line in lines])
        return figure

    return Chart(title, inline_svg(draw), _describe(lines))


def _by_type(task: str, lines: Sequence[_Line]) -> Chart:
    types = sorted({name for line in lines for name in line.task.by_question_type}, reverse=True)

    def draw() -> Figure:
        height = max(_PANEL[1], 0.8 + _ROW * len(types))
        figure = Figure(figsize=(_PANEL[0] + LEGEND, height), layout="constrained")
        axes = figure.subplots()
        for number, line in enumerate(lines):
            cells = [line.task.by_question_type.get(name) for name in types]
            _dots(axes, cells, line, -_offset(number, len(lines)), is_flat=True)
        axes.set_yticks(range(len(types)), [printable(name)[:40] for name in types])
        axes.set_xlim(-3, 103)
        axes.set_xlabel(f"{lines[0].metric} (%)")
        axes.grid(axis="y", visible=False)
        add_legend(axes, [(line.label, line.look) for line in lines])
        return figure

    return Chart(f"{task}: accuracy by type of question", inline_svg(draw), _describe(lines))


def _offset(number: int, n_lines: int) -> float:
    return 0.0 if n_lines == 1 else _SPREAD * (number / (n_lines - 1) - 0.5)


def _dots(
    axes: Axes, cells: Sequence[Cell | None], line: _Line, offset: float, *, is_flat: bool = False
) -> None:
    """Draw a dot with its interval for each cell that has questions."""
    for at, cell in enumerate(cells):
        if cell is not None and cell.scores:
            _dot(axes, cell.scores[line.metric], at + offset, line.look.colour, is_flat=is_flat)


def _dot(
    axes: Axes,
    score: Score | MeanEstimate | AboveGuessing,
    where: float,
    colour: str,
    *,
    is_flat: bool,
) -> None:
    mean = 100 * (score.mean or 0)
    axes.plot(
        *((mean, where) if is_flat else (where, mean)), marker="o", ms=4.5, color=colour, zorder=3
    )
    if score.low is not None and score.high is not None:
        span = axes.hlines if is_flat else axes.vlines
        span(where, 100 * score.low, 100 * score.high, color=colour, lw=1.3, zorder=2.8)


def _describe(lines: Sequence[_Line]) -> str:
    """Return the totals in words."""
    totals = ((line.label, mean_cell(line.task.total, line.metric, 1)) for line in lines)
    return "; ".join(f"{label} {mean} %" for label, mean in totals)


def _gains_chart(runs: Sequence[ReportRun]) -> Chart | None:
    """Draw each run's gain over blank frames, a row per task; None without a run on blank ones."""
    summaries = [run.summary for run in runs]
    rows = []
    for gain in find_gains(summaries):
        total = gain.total()
        if gain.metric == main_metric(gain.seeing) and total is not None:
            rows.append((f"{name_of(gain.run)}, {gain.task}", total))
    return _by_rows("Gain over blank frames", rows, "gain, in points, and its 95 % interval")


def _above_guessing_chart(runs: Sequence[ReportRun]) -> Chart | None:
    """Draw the score above guessing of each run, a row per task; None if no guess is known."""
    rows = [
        (f"{run.label}, {name}", above)
        for run in runs
        for name, task in run.summary.summary.tasks.items()
        if (above := task.above_guessing.get(main_metric(task))) is not None
        and above.mean is not None
    ]
    return _by_rows("Above guessing", rows, "% above guessing, and 95 % interval")


def _by_rows(
    title: str, rows: Sequence[tuple[str, MeanEstimate | AboveGuessing]], label: str
) -> Chart | None:
    """Draw a row with a dot for each value, around a line at 0; None without rows."""
    if not rows:
        return None

    def draw() -> Figure:
        figure = Figure(
            figsize=(_PANEL[0] + LEGEND, max(_PANEL[1], 0.8 + _ROW * len(rows))),
            layout="constrained",
        )
        axes = figure.subplots()
        axes.axvline(0, color="#444444", lw=0.8)
        for height, (_, value) in enumerate(reversed(rows)):
            _dot(axes, value, height, _GAIN, is_flat=True)
        axes.set_yticks(range(len(rows)), [printable(name)[:60] for name, _ in reversed(rows)])
        axes.set_ylim(-0.6, len(rows) - 0.4)
        low, high = axes.get_xlim()
        # Nothing at all would be drawn on a scale of hundredths.
        axes.set_xlim(min(low, -5), max(high, 5))
        axes.set_xlabel(label)
        axes.grid(axis="y", visible=False)
        return figure

    description = "; ".join(f"{name} {100 * (value.mean or 0):+.1f}" for name, value in rows)
    return Chart(title, inline_svg(draw), description)


def _heat_map(run: ReportRun) -> Chart | None:
    """Draw accuracy by depth of the needle and context size; None if no task has depths."""
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
        axes.set_xticks(range(len(sizes)), [f"{size}K" if size else "all" for size in sizes])
        axes.set_yticks(range(len(depths)), [depth.removeprefix(_DEPTH) for depth in depths])
        axes.set_xlabel("context (thousand tokens)")
        axes.set_ylabel("depth of the needle")
        figure.colorbar(picture, ax=axes, label=f"{metric} (%)")
        return figure

    return Chart(
        f"{run.label}: accuracy by depth and size of the context",
        inline_svg(draw),
        "see the table by depth",
    )


def _percent(cell: Cell | None, metric: str) -> float:
    score = None if cell is None else cell.scores.get(metric)
    return math.nan if score is None else 100 * score.mean
