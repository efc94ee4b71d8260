"""Two runs of one suite on the same units: by how much the second is better, and how surely."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.runs import Suite, UnitRecord
from infthor_eval.statistics import Difference, paired_difference
from infthor_eval.tables import Column, Row, Table

__all__ = ["Comparison", "compare", "comparison_table"]


@dataclass(frozen=True)
class Comparison:
    """One task, one metric.

    Attributes:
        task: the task.
        metric: which metric of the suite.
        first: mean score of the first run on the shared units.
        second: that of the second run.
        difference: second minus first, paired by unit and clustered.
        n_unshared: units that only one of the runs evaluated; they are not compared.
    """

    task: str
    metric: str
    first: float
    second: float
    difference: Difference
    n_unshared: int


def compare(suite: Suite, first: Iterable[UnitRecord[Any]], second: Iterable[UnitRecord[Any]]) -> list[Comparison]:
    """Compare two runs on the units that both evaluated.

    Raises:
        DataError: they share no unit.
    """
    ours, theirs = ({record.key: record for record in records} for records in (first, second))
    if not ours.keys() & theirs.keys():
        raise DataError("the two runs share no unit of the same task; compare runs on the same data")
    found = []
    for task in sorted({key.task for key in ours.keys() & theirs.keys()}):
        pairs = [(ours[key], theirs[key]) for key in ours if key in theirs and key.task == task]
        unshared = sum(key.task == task for key in ours.keys() ^ theirs.keys())
        found += _of_task(suite, task, pairs, unshared)
    return found


def _of_task(
    suite: Suite, task: str, pairs: Sequence[tuple[UnitRecord[Any], UnitRecord[Any]]], unshared: int
) -> list[Comparison]:
    scores = [(suite.scores(a), suite.scores(b)) for a, b in pairs]
    clusters = [a.cluster for a, _ in pairs]
    found = []
    for metric in dict.fromkeys(name for a, b in scores for name in (*a, *b)):
        first, second = [a.get(metric, 0.0) for a, _ in scores], [b.get(metric, 0.0) for _, b in scores]
        difference = paired_difference(first, second, clusters)
        means = sum(first) / len(first), sum(second) / len(second)
        found.append(Comparison(task, metric, *means, difference, unshared))
    return found


def comparison_table(rows: Sequence[Comparison], first: str, second: str) -> Table:
    """Differences in percentage points: a row per task and metric.

    Args:
        rows: what `compare` found.
        first: the first run's name.
        second: the second run's name.
    """
    numbers = ("first", "second", "difference", "95 % interval", "p", "units", "only in one")
    columns = (Column("task", False), Column("metric", False), *map(Column, numbers))
    return Table(f"{second} against {first}, in %", columns, tuple(map(_row, rows)))


def _row(found: Comparison) -> Row:
    estimate, p = found.difference.estimate, found.difference.p
    interval = significance = "-"  # one cluster alone tells nothing about others
    if estimate.low is not None and estimate.high is not None and p is not None:
        interval, significance = f"[{100 * estimate.low:+.2f}, {100 * estimate.high:+.2f}]", f"{p:.4f}"
    means = (f"{100 * found.first:.2f}", f"{100 * found.second:.2f}", f"{100 * estimate.mean:+.2f}")
    counts = (str(estimate.n), str(found.n_unshared))
    return Row((found.task, found.metric, *means, interval, significance, *counts))
