"""Chart of memories: accuracy against tokens per question, a curve over budgets for each memory."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter

from infthor_eval.nieh.results.cells import Score
from infthor_eval.nieh.results.summary import main_metric
from infthor_eval.report.figures.style import LEGEND, add_legend, inline_svg, looks_of
from infthor_eval.report.runs import ReportRun
from infthor_eval.report.web.sections import Chart

__all__ = ["memory_charts"]

_SIZE = 4.6, 3.2  # inches


class _Point(NamedTuple):
    n_tokens: float
    score: Score


def memory_charts(runs: Sequence[ReportRun]) -> Iterator[Chart]:
    """Yield a chart for each task with memories whose models count their tokens."""
    tasks = dict.fromkeys(
        name
        for run in runs
        for name, task in run.summary.summary.tasks.items()
        if task.memory is not None
    )
    for task in tasks:
        curves = _curves(runs, task)
        if curves:
            yield _chart(task, curves)


def _curves(runs: Sequence[ReportRun], task: str) -> dict[str, list[_Point]]:
    """Return the points of each memory, of each subject if there are several, by tokens."""
    by_memory: dict[tuple[str, str], list[_Point]] = {}
    for run in runs:
        of_task = run.summary.summary.tasks.get(task)
        if of_task is None or of_task.memory is None or of_task.memory.n_tokens is None:
            continue
        memory = f"{of_task.memory.name}{'*' if of_task.memory.privileged else ''}"
        score = of_task.total.scores.get(main_metric(of_task))
        if score is not None:
            point = _Point(of_task.memory.n_tokens, score)
            by_memory.setdefault((run.model, memory), []).append(point)
    several = len({subject for subject, _ in by_memory}) > 1
    return {
        f"{subject}, {memory}" if several else memory: sorted(
            points, key=lambda point: point.n_tokens
        )
        for (subject, memory), points in by_memory.items()
    }


def _chart(task: str, curves: dict[str, list[_Point]]) -> Chart:
    looks = looks_of(curves)

    def draw() -> Figure:
        figure = Figure(figsize=(_SIZE[0] + LEGEND, _SIZE[1]), layout="constrained")
        axes = figure.subplots()
        for name, points in curves.items():
            colour = looks[name].colour
            tokens = [point.n_tokens for point in points]
            means = [100 * point.score.mean for point in points]
            axes.plot(
                tokens,
                means,
                marker="o",
                ms=4.5,
                lw=1.3,
                ls=looks[name].style,
                color=colour,
                zorder=3,
            )
            for point in points:
                if point.score.low is not None and point.score.high is not None:
                    axes.vlines(
                        point.n_tokens,
                        100 * point.score.low,
                        100 * point.score.high,
                        color=colour,
                        lw=0.8,
                    )
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(ScalarFormatter())
        axes.set_ylim(-3, 103)
        axes.set_xlabel("tokens of a question (mean)")
        axes.set_ylabel("accuracy (%), and 95 % interval")
        add_legend(axes, [(name, looks[name]) for name in curves])
        return figure

    described = []
    for name, points in curves.items():
        texts = [
            f"{100 * point.score.mean:.1f} % at {point.n_tokens:,.0f} tokens" for point in points
        ]
        described.append(f"{name} {', '.join(texts)}")
    description = "; ".join(described)
    return Chart(
        f"{task}: accuracy by tokens of what a memory recalls", inline_svg(draw), description
    )
