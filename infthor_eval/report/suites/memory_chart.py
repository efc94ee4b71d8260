"""Chart of memories: accuracy against tokens per question, a curve over budgets for each memory."""

from collections.abc import Iterator, Sequence

from infthor_eval.nieh.results.summary import main_metric
from infthor_eval.report.svg.dots import dot_of
from infthor_eval.report.svg.points import Point, PointsChart, points_chart
from infthor_eval.report.web.sections import Chart
from infthor_eval.run import Run


def memory_charts(runs: Sequence[Run]) -> Iterator[Chart]:
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


def _curves(runs: Sequence[Run], task: str) -> dict[str, list[Point]]:
    """Return the points of each memory, of each subject if there are several, by tokens."""
    by_memory: dict[tuple[str, str], list[Point]] = {}
    for run in runs:
        of_task = run.summary.summary.tasks.get(task)
        if of_task is None or of_task.memory is None or not of_task.memory.n_tokens:
            continue
        memory = f"{of_task.memory.name}{'*' if of_task.memory.privileged else ''}"
        score = of_task.total.scores.get(main_metric(of_task))
        if score is not None:
            point = Point(of_task.memory.n_tokens, dot_of(score, of_task.total.n_answered))
            by_memory.setdefault((run.model, memory), []).append(point)
    several = len({subject for subject, _ in by_memory}) > 1
    return {
        f"{subject}, {memory}" if several else memory: sorted(points, key=lambda point: point.cost)
        for (subject, memory), points in by_memory.items()
    }


def _chart(task: str, curves: dict[str, list[Point]]) -> Chart:
    caption = (
        "Up and to the left is better: a mark is a memory at a budget, its line the 95 % interval; "
        "tokens are on a log scale, and * marks memories that know what no agent can."
    )
    title = f"{task}: accuracy by tokens of what a memory recalls"
    axes = ("tokens of a question (mean)", "accuracy (%)")
    return points_chart(PointsChart(title, caption, axes, curves))
