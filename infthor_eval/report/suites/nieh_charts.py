"""Charts of NIEH: accuracy by clues, type, evidence and depth, gains, and memories."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import NamedTuple

from infthor_eval.formats.question import ABSENCE
from infthor_eval.nieh.results.above_blind import AboveBlind, FormScore
from infthor_eval.nieh.results.cells import Cell, mean_cell
from infthor_eval.nieh.results.evidence_tables import facet_cells, short_name
from infthor_eval.nieh.results.facets import DEPTH, FACETS, QuestionFacet
from infthor_eval.nieh.results.gains import find_gains
from infthor_eval.nieh.results.summary import CLUE_COLUMNS, TaskSummary, main_metric
from infthor_eval.nieh.results.tables import by_depth
from infthor_eval.rates import Rate
from infthor_eval.report.charts import (
    Chart,
    Class,
    Point,
    Series,
    class_series,
    counted_classes,
    point_of,
)
from infthor_eval.run import Run
from infthor_eval.statistics import MeanEstimate

_COLUMNS = (*CLUE_COLUMNS, ABSENCE)


class _Line(NamedTuple):
    """Results of a run on a task."""

    label: str
    place: int
    task: TaskSummary

    @property
    def metric(self) -> str:
        return main_metric(self.task)


def nieh_charts(runs: Sequence[Run]) -> list[Chart]:
    """Draw all charts that the runs have numbers for."""
    charts: list[Chart] = []
    for task in dict.fromkeys(name for run in runs for name in run.summary.summary.tasks):
        lines = [
            _Line(run.label, place, run.summary.summary.tasks[task])
            for place, run in enumerate(runs)
            if task in run.summary.summary.tasks and run.summary.summary.tasks[task].n
        ]
        if lines:
            charts += _charts_of_task(task, lines)
    summaries = [_gains_chart(runs), _above_blind_chart(runs)]
    by_size = [_depths_and_sizes(run) for run in runs]
    drawn = [chart for chart in (*summaries, *by_size) if chart is not None]
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
    series = [
        class_series(line.label, line.place, names, _rates(of_line, line.metric))
        for of_line, line in zip(cells, lines, strict=True)
    ]
    return Chart(
        title=f"{task}: accuracy by {by}",
        caption=(
            "A row is a class of questions, with their number in parentheses; a dot is a run, "
            "its line the 95 % interval over trajectories."
        ),
        axes=(by, f"{lines[0].metric} (%)"),
        series=series,
        classes=counted_classes([name.removeprefix(DEPTH) for name in names], series),
        words=_describe(lines),
    )


def _rates(cells: Mapping[str, Cell], metric: str) -> dict[str, Rate]:
    return {
        name: Rate(score.mean, score.low, score.high, cell.n_answered)
        for name, cell in cells.items()
        if (score := cell.scores.get(metric)) is not None
    }


def _forms(line: _Line) -> Mapping[str, FormScore]:
    above = line.task.above_blind.get(line.metric)
    return {} if above is None else above.forms


def _by_form(task: str, lines: Sequence[_Line]) -> Chart:
    """Draw a row per form of question, with what `blind` scores in it."""
    forms = [_forms(line) for line in lines]
    names = sorted(set().union(*forms))
    series = []
    for line, known in zip(lines, forms, strict=True):
        rates = {name: Rate(form.score, None, None, form.n) for name, form in known.items()}
        series.append(class_series(line.label, line.place, names, rates))
    blind = {name: form.blind for known in reversed(forms) for name, form in known.items()}
    return Chart(
        title=f"{task}: accuracy by form, beside blind",
        caption=(
            "A row is a form of question, with the number of those answered in parentheses: "
            "dots to the right of the dashed line know more than blind, which sees no frame."
        ),
        axes=("form", f"{lines[0].metric} (%)"),
        series=series,
        classes=counted_classes(names, series, [100 * blind[name] for name in names]),
        words=_describe(lines),
    )


def _describe(lines: Sequence[_Line]) -> str:
    """Return the totals in words."""
    totals = ((line.label, mean_cell(line.task.total, line.metric, 1)) for line in lines)
    return "; ".join(f"{label} {mean} %" for label, mean in totals)


def _gains_chart(runs: Sequence[Run]) -> Chart | None:
    """Draw each run's gain over blank frames, a row per task; None without a run on blank ones."""
    summaries = [run.summary for run in runs]
    rows = []
    for gain in find_gains(summaries):
        total = gain.total()
        if gain.metric == main_metric(gain.seeing) and total is not None:
            rows.append((f"{gain.run.header.label}, {gain.task}", total))
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
    # Nothing at all would be drawn on a scale of hundredths.
    return Chart(
        title=title,
        caption=caption,
        axes=("run and task", axis),
        series=(Series("value", [point_of(x, value) for x, (_, value) in enumerate(rows)]),),
        classes=[Class(name) for name, _ in rows],
        limits=(-5.0, 5.0),
        words="; ".join(f"{name} {100 * (value.mean or 0):+.1f}" for name, value in rows),
    )


def _depths_and_sizes(run: Run) -> Chart | None:
    """Draw accuracy by depth of the needle and context size; None if no task has depths."""
    tasks: dict[int, TaskSummary] = {}
    for name, task in run.summary.summary.tasks.items():
        if by_depth(task):
            tasks[int(run.tasks[name].dataset_kwargs.get("ctx_size") or 0)] = task
    if not tasks:
        return None
    metric = main_metric(next(iter(tasks.values())))
    depths = sorted(set().union(*map(by_depth, tasks.values())))
    return Chart(
        title=f"{run.label}: accuracy by depth and size of the context",
        caption=(
            f"Darker is better: {metric} in percent, by where the needle is and how long the "
            "context."
        ),
        axes=("depth", "context (thousand tokens)"),
        series=[
            class_series(f"{size}K" if size else "all", 0, depths, _rates(by_depth(task), metric))
            for size, task in sorted(tasks.items())
        ],
        form="grid",
        classes=[Class(depth.removeprefix(DEPTH)) for depth in depths],
        words="see the table by depth",
    )


def memory_charts(runs: Sequence[Run]) -> Iterator[Chart]:
    """Yield accuracy against tokens for each task with memories whose models count them, a curve
    over budgets for each memory."""
    tasks = dict.fromkeys(
        name
        for run in runs
        for name, task in run.summary.summary.tasks.items()
        if task.memory is not None
    )
    for task in tasks:
        curves = _memories(runs, task)
        if curves:
            yield Chart(
                title=f"{task}: accuracy by tokens of what a memory recalls",
                caption=(
                    "Up and to the left is better: a mark is a memory at a budget, its line the "
                    "95 % interval; tokens are on a log scale, and * marks memories that know what "
                    "no agent can."
                ),
                axes=("tokens of a question (mean)", "accuracy (%)"),
                series=curves,
                form="log",
            )


def _memories(runs: Sequence[Run], task: str) -> list[Series]:
    """Return the points of each memory, of each subject if there are several, by tokens."""
    by_memory: dict[tuple[str, str], list[Point]] = {}
    for run in runs:
        of_task = run.summary.summary.tasks.get(task)
        if of_task is None or of_task.memory is None or not of_task.memory.n_tokens:
            continue
        memory = f"{of_task.memory.name}{'*' if of_task.memory.privileged else ''}"
        score = of_task.total.scores.get(main_metric(of_task))
        if score is not None:
            point = point_of(of_task.memory.n_tokens, score, of_task.total.n_answered)
            by_memory.setdefault((run.model, memory), []).append(point)
    several = len({subject for subject, _ in by_memory}) > 1
    return [
        Series(
            f"{subject}, {memory}" if several else memory,
            sorted(points, key=lambda point: point.x),
            place,
        )
        for place, ((subject, memory), points) in enumerate(by_memory.items())
    ]
