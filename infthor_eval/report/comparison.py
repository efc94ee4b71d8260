"""Two runs of one suite on the same units: the difference of their scores, with interval and p value."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.report.presenter import Presenter
from infthor_eval.runs import Suite, UnitRecord
from infthor_eval.statistics import Difference, paired_difference
from infthor_eval.tables import Column, Row, Table, interval_cell

__all__ = ["Comparison", "compare", "comparison_table"]

Record = UnitRecord[Any]


@dataclass(frozen=True)
class Comparison:
    """A metric of a task in two runs.

    Attributes:
        task: name of the task.
        metric: name of the metric.
        is_share: whether the metric is a share, which is shown in percent.
        first: mean score of the first run on the shared units.
        second: mean score of the second run on them.
        difference: second minus first, paired by unit and clustered.
        n_unshared: number of units that only one of the runs evaluated; they are not compared.
    """

    task: str
    metric: str
    is_share: bool
    first: float
    second: float
    difference: Difference
    n_unshared: int


def compare(suite: Suite, presenter: Presenter, first: Iterable[Record], second: Iterable[Record]) -> list[Comparison]:
    """Compare the records of two runs of a suite on the units that both evaluated.

    Raises:
        DataError: they share no unit.
    """
    ours, theirs = ({record.key: record for record in records} for records in (first, second))
    shared = ours.keys() & theirs.keys()
    if not shared:
        raise DataError("the two runs share no unit of the same task; compare runs on the same data")
    comparisons: list[Comparison] = []
    for task in sorted({key.task for key in shared}):
        pairs = [(ours[key], theirs[key]) for key in ours if key in shared and key.task == task]
        n_unshared = sum(key.task == task for key in ours.keys() ^ theirs.keys())
        comparisons += _compare_task(suite, presenter, task, pairs, n_unshared)
    return comparisons


def _compare_task(
    suite: Suite, presenter: Presenter, task: str, pairs: Sequence[tuple[Record, Record]], n_unshared: int
) -> Iterator[Comparison]:
    scores = [(suite.scores(ours), suite.scores(theirs)) for ours, theirs in pairs]
    clusters = [ours.cluster for ours, _ in pairs]
    for metric in dict.fromkeys(name for pair in scores for of_run in pair for name in of_run):
        # A unit without results has no scores, and counts as 0.
        both = [(ours.get(metric, 0.0), theirs.get(metric, 0.0)) for ours, theirs in scores]
        yield _compare_metric(presenter, task, metric, both, clusters, n_unshared)
    further = [(presenter.further_scores(ours), presenter.further_scores(theirs)) for ours, theirs in pairs]
    for metric in dict.fromkeys(name for ours, theirs in further for name in ours if name in theirs):
        chosen = [place for place, (ours, theirs) in enumerate(further) if metric in ours and metric in theirs]
        both = [(further[place][0][metric], further[place][1][metric]) for place in chosen]
        yield _compare_metric(presenter, task, metric, both, [clusters[place] for place in chosen], n_unshared)


def _compare_metric(
    presenter: Presenter,
    task: str,
    metric: str,
    scores: Sequence[tuple[float, float]],
    clusters: Sequence[str],
    n_unshared: int,
) -> Comparison:
    first, second = map(list, zip(*scores, strict=True))
    is_share = presenter.is_share(metric, [*first, *second])
    means = sum(first) / len(first), sum(second) / len(second)
    return Comparison(task, metric, is_share, *means, paired_difference(first, second, clusters), n_unshared)


def comparison_table(comparisons: Sequence[Comparison], first: str, second: str) -> Table:
    """Return a table with a row per task and metric, each in its own unit; `first` and `second` name the runs."""
    numbers = ("first", "second", "difference", "95 % interval", "p", "samples", "only in one")
    columns = (Column("task", False), Column("metric", False), Column("unit", False), *map(Column, numbers))
    return Table(f"{second} against {first}", columns, tuple(map(_row, comparisons)))


def _row(comparison: Comparison) -> Row:
    unit, factor = ("%", 100.0) if comparison.is_share else ("points", 1.0)
    estimate, p = comparison.difference.estimate, comparison.difference.p
    low, high = (None if end is None else factor * end for end in (estimate.low, estimate.high))
    numbers = (
        f"{factor * comparison.first:.2f}",
        f"{factor * comparison.second:.2f}",
        f"{factor * estimate.mean:+.2f}",
        interval_cell(low, high, "+.2f"),
        "-" if p is None else f"{p:.4f}",  # a single cluster has neither interval nor p
        str(estimate.n),
        str(comparison.n_unshared),
    )
    return Row((comparison.task, comparison.metric, unit, *numbers))
