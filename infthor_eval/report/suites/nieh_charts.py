"""Pictures of NIEH results: accuracy by clues and by type of question, by depth and size of context, gain by frames."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from infthor_eval.formats.question import ABSENCE
from infthor_eval.nieh.gains import gains, name_of
from infthor_eval.nieh.summary import CLUE_COLUMNS, Cell, Score, TaskSummary, main_metric
from infthor_eval.report.figures.style import LEGEND, Look, add_legend, inline_svg, looks_of
from infthor_eval.report.runs import ReportRun
from infthor_eval.report.web.sections import Chart
from infthor_eval.statistics import MeanEstimate
from infthor_eval.terminal import printable

__all__ = ["nieh_charts"]

_COLUMNS = (*CLUE_COLUMNS, ABSENCE)
_SPREAD = 0.6  # of the room between two columns that the dots of several runs take
_PANEL, _ROW = (4.6, 2.6), 0.34  # inches
_DEPTH = "depth="
_GAIN = looks_of(("gain",))["gain"].colour


class _Line(NamedTuple):
    """A run, in a task."""

    label: str
    task: TaskSummary
    look: Look

    @property
    def metric(self) -> str:
        """That the task is known by."""
        return main_metric(self.task)


def nieh_charts(runs: Sequence[ReportRun]) -> list[Chart]:
    """All pictures that there is something to draw for."""
    looks = looks_of(run.label for run in runs)
    charts = []
    for task in dict.fromkeys(name for run in runs for name in run.summary.summary.tasks):
        lines = [
            _Line(run.label, run.summary.summary.tasks[task], looks[run.label])
            for run in runs
            if task in run.summary.summary.tasks and run.summary.summary.tasks[task].n
        ]
        if lines:
            charts += [_by_clues(task, lines), _by_type(task, lines)]
    by_frames = _gains_chart(runs)
    heat_maps = (chart for run in runs if (chart := _heat_map(run)) is not None)
    return [*charts, *([by_frames] if by_frames else []), *heat_maps]


def _by_clues(task: str, lines: Sequence[_Line]) -> Chart:
    def make() -> Figure:
        figure = Figure(figsize=(_PANEL[0] + LEGEND, _PANEL[1]), layout="constrained")
        place = figure.subplots()
        for number, line in enumerate(lines):
            _dots(place, [line.task.by_clues[name] for name in _COLUMNS], line, _off(number, len(lines)))
        counts = [lines[0].task.by_clues[name].n for name in _COLUMNS]
        names = [f"{name}\n({n})" for name, n in zip(_COLUMNS, counts, strict=True)]
        place.set_xticks(range(len(_COLUMNS)), names)
        place.set_ylim(-3, 103)
        place.set_ylabel(f"{lines[0].metric} (%)")
        place.set_xlabel("clues (questions)")
        place.grid(axis="x", visible=False)
        add_legend(place, [(line.label, line.look) for line in lines])
        return figure

    return Chart(f"{task}: accuracy by number of clues", inline_svg(make), _told(lines))


def _by_type(task: str, lines: Sequence[_Line]) -> Chart:
    types = sorted({name for line in lines for name in line.task.by_question_type}, reverse=True)

    def make() -> Figure:
        height = max(_PANEL[1], 0.8 + _ROW * len(types))
        figure = Figure(figsize=(_PANEL[0] + LEGEND, height), layout="constrained")
        place = figure.subplots()
        for number, line in enumerate(lines):
            cells = [line.task.by_question_type.get(name) for name in types]
            _dots(place, cells, line, -_off(number, len(lines)), is_flat=True)
        place.set_yticks(range(len(types)), [printable(name)[:40] for name in types])
        place.set_xlim(-3, 103)
        place.set_xlabel(f"{lines[0].metric} (%)")
        place.grid(axis="y", visible=False)
        add_legend(place, [(line.label, line.look) for line in lines])
        return figure

    return Chart(f"{task}: accuracy by type of question", inline_svg(make), _told(lines))


def _off(number: int, n_lines: int) -> float:
    return 0.0 if n_lines == 1 else _SPREAD * (number / (n_lines - 1) - 0.5)


def _dots(place: Axes, cells: Sequence[Cell | None], line: _Line, off: float, *, is_flat: bool = False) -> None:
    """A dot with its interval for each cell that was asked."""
    for at, cell in enumerate(cells):
        if cell is not None and cell.n:
            _dot(place, cell.scores[line.metric], at + off, line.look.colour, is_flat=is_flat)


def _dot(place: Axes, score: Score | MeanEstimate, where: float, colour: str, *, is_flat: bool) -> None:
    mean = 100 * score.mean
    place.plot(*((mean, where) if is_flat else (where, mean)), marker="o", ms=4.5, color=colour, zorder=3)
    if score.low is not None and score.high is not None:
        span = place.hlines if is_flat else place.vlines
        span(where, 100 * score.low, 100 * score.high, color=colour, lw=1.3, zorder=2.8)


def _told(lines: Sequence[_Line]) -> str:
    """In words: the totals."""
    totals = ((line.label, line.task.by_clues["total"].scores[line.metric]) for line in lines)
    return "; ".join(f"{label} {100 * score.mean:.1f} %" for label, score in totals)


def _gains_chart(runs: Sequence[ReportRun]) -> Chart | None:
    """What each run scores above the same model on blank frames, a line a task; None where there is no such pair."""
    found = [
        (f"{name_of(gain.run)}, {gain.task}", total)
        for gain in gains([run.summary for run in runs])
        if gain.metric == main_metric(gain.seeing) and (total := gain.total()) is not None
    ]
    if not found:
        return None

    def make() -> Figure:
        figure = Figure(figsize=(_PANEL[0] + LEGEND, max(_PANEL[1], 0.8 + _ROW * len(found))), layout="constrained")
        place = figure.subplots()
        place.axvline(0, color="#444444", lw=0.8)
        for row, (_, total) in enumerate(reversed(found)):
            _dot(place, total, row, _GAIN, is_flat=True)
        place.set_yticks(range(len(found)), [printable(name)[:60] for name, _ in reversed(found)])
        place.set_ylim(-0.6, len(found) - 0.4)
        place.set_xlabel("gain, in points, and its 95 % interval")
        place.grid(axis="y", visible=False)
        return figure

    told = "; ".join(f"{name} {100 * total.mean:+.1f} points" for name, total in found)
    return Chart("Gain over blank frames", inline_svg(make), told)


def _heat_map(run: ReportRun) -> Chart | None:
    """Accuracy of a run by depth of the needle and size of the context; None where no task of it has depths."""
    tasks = {
        int(run.dataset(name).get("ctx_size") or 0): task
        for name, task in run.summary.summary.tasks.items()
        if any(variant.startswith(_DEPTH) for variant in task.by_variant)
    }
    if not tasks:
        return None
    sizes, metric = sorted(tasks), main_metric(next(iter(tasks.values())))
    depths = sorted({depth for task in tasks.values() for depth in task.by_variant if depth.startswith(_DEPTH)})
    means = [[_percent(tasks[size].by_variant.get(depth), metric) for size in sizes] for depth in depths]

    def make() -> Figure:
        figure = Figure(figsize=(2.2 + 0.9 * len(sizes), 1.4 + 0.5 * len(depths)), layout="constrained")
        place = figure.subplots()
        place.grid(visible=False)
        # A single-hued scale whose lightness alone tells, for colour-blind readers and for print.
        picture = place.imshow(means, cmap="Blues", vmin=0, vmax=100, aspect="auto")
        for row, values in enumerate(means):
            for column, value in enumerate(values):
                ink = "white" if value > 55 else "#222222"
                text = "-" if math.isnan(value) else f"{value:.0f}"
                place.text(column, row, text, ha="center", va="center", color=ink)
        place.set_xticks(range(len(sizes)), [f"{size}K" if size else "all" for size in sizes])
        place.set_yticks(range(len(depths)), [depth.removeprefix(_DEPTH) for depth in depths])
        place.set_xlabel("context (thousand tokens)")
        place.set_ylabel("depth of the needle")
        figure.colorbar(picture, ax=place, label=f"{metric} (%)")
        return figure

    return Chart(f"{run.label}: accuracy by depth and size of the context", inline_svg(make), "see the table by depth")


def _percent(cell: Cell | None, metric: str) -> float:
    return math.nan if cell is None or not cell.n else 100 * cell.scores[metric].mean
