"""Two runs of one suite on the same units: the difference of their scores, with interval and p
value.

A unit that was repeated counts with its mean scores, so that runs of different numbers of
repetitions can be compared.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, variance
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.report.presenter import Presenter
from infthor_eval.runs import Suite, UnitKey, UnitRecord
from infthor_eval.statistics import Difference, paired_difference
from infthor_eval.tables import Column, Row, Table, interval_cell

__all__ = ["Comparison", "compare", "comparison_table"]

Record = UnitRecord[Any]
_Pair = tuple[Sequence[Record], Sequence[Record]]  # the repetitions of a unit in two runs
_NORMAL_95 = 1.96


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
        drawing: half the width of the difference's 95 % interval over other drawings of both runs'
            replies to the same units; None if not every unit was repeated in both.
    """

    task: str
    metric: str
    is_share: bool
    first: float
    second: float
    difference: Difference
    n_unshared: int
    drawing: float | None


def compare(
    suite: Suite, presenter: Presenter, first: Iterable[Record], second: Iterable[Record]
) -> list[Comparison]:
    """Compare the records of two runs of a suite on the units that both evaluated.

    Raises:
        DataError: they share no unit.
    """
    ours, theirs = map(_by_unit, (first, second))
    shared = ours.keys() & theirs.keys()
    if not shared:
        raise DataError(
            "the two runs share no unit of the same task; compare runs on the same data"
        )
    comparisons: list[Comparison] = []
    for task in sorted({key.task for key in shared}):
        pairs = [(ours[key], theirs[key]) for key in ours if key in shared and key.task == task]
        n_unshared = sum(key.task == task for key in ours.keys() ^ theirs.keys())
        comparisons += _compare_task(suite, presenter, task, pairs, n_unshared)
    return comparisons


def _compare_task(
    suite: Suite, presenter: Presenter, task: str, pairs: Sequence[_Pair], n_unshared: int
) -> Iterator[Comparison]:
    scores = [
        (list(map(suite.scores, ours)), list(map(suite.scores, theirs))) for ours, theirs in pairs
    ]
    clusters = [ours[0].cluster for ours, _ in pairs]
    for metric in _shared_metrics(scores):
        # A unit without results has no scores, and counts as 0.
        both = [(_values(ours, metric), _values(theirs, metric)) for ours, theirs in scores]
        yield _compare_metric(presenter, task, metric, both, clusters, n_unshared)
    further = [
        (list(map(presenter.further_scores, ours)), list(map(presenter.further_scores, theirs)))
        for ours, theirs in pairs
    ]
    scored = [
        pair for pair, (ours, theirs) in zip(further, scores, strict=True) if ours[0] and theirs[0]
    ]
    for metric in dict.fromkeys(
        name for ours, theirs in scored or further for name in ours[0] if name in theirs[0]
    ):
        # Whether a unit has such a score depends on the unit, not on the reply.
        chosen = [
            place
            for place, (ours, theirs) in enumerate(further)
            if metric in ours[0] and metric in theirs[0]
        ]
        both = [
            (_values(further[place][0], metric), _values(further[place][1], metric))
            for place in chosen
        ]
        yield _compare_metric(
            presenter, task, metric, both, [clusters[place] for place in chosen], n_unshared
        )


def _shared_metrics(
    scores: Sequence[tuple[Sequence[Mapping[str, float]], Sequence[Mapping[str, float]]]],
) -> list[str]:
    """Return the metrics that both runs have; all of the other run's if one has no unit with a
    result."""
    first, second = (
        dict.fromkeys(name for of_run in runs for one in of_run for name in one)
        for runs in zip(*scores, strict=True)
    )
    return [
        name
        for name in first | second
        if (not first or name in first) and (not second or name in second)
    ]


def _by_unit(records: Iterable[Record]) -> dict[UnitKey, list[Record]]:
    """Return the repetitions of each unit."""
    units: dict[UnitKey, list[Record]] = {}
    for record in records:
        units.setdefault(record.key.once, []).append(record)
    return units


def _values(scores: Sequence[Mapping[str, float]], metric: str) -> list[float]:
    return [one.get(metric, 0.0) for one in scores]


def _compare_metric(
    presenter: Presenter,
    task: str,
    metric: str,
    scores: Sequence[tuple[Sequence[float], Sequence[float]]],
    clusters: Sequence[str],
    n_unshared: int,
) -> Comparison:
    first, second = ([fmean(values) for values in of_run] for of_run in zip(*scores, strict=True))
    is_share = presenter.is_share(metric, [*first, *second])
    means = sum(first) / len(first), sum(second) / len(second)
    difference = paired_difference(first, second, clusters)
    return Comparison(task, metric, is_share, *means, difference, n_unshared, _drawing(scores))


def _drawing(scores: Sequence[tuple[Sequence[float], Sequence[float]]]) -> float | None:
    """Return `Comparison.drawing` of the scores of repeated units in two runs."""
    samples = [values for pair in scores for values in pair]
    if any(len(values) < 2 for values in samples):
        return None
    return (
        _NORMAL_95
        * math.sqrt(sum(variance(values) / len(values) for values in samples))
        / len(scores)
    )


def comparison_table(comparisons: Sequence[Comparison], first: str, second: str) -> Table:
    """Return a table with a row per task and metric, each in its own unit; `first` and `second`
    name the runs."""
    repeated = any(comparison.drawing is not None for comparison in comparisons)
    numbers = ["first", "second", "difference", "95 % interval", "p", "samples", "only in one"]
    numbers += ["drawing"] if repeated else []
    notes = (
        ("drawing: what the difference moves by if both are asked the same again (95 %).",)
        if repeated
        else ()
    )
    columns = (
        Column("task", False),
        Column("metric", False),
        Column("unit", False),
        *map(Column, numbers),
    )
    rows = tuple(_row(comparison, repeated=repeated) for comparison in comparisons)
    return Table(f"{second} against {first}", columns, rows, notes)


def _row(comparison: Comparison, *, repeated: bool) -> Row:
    unit, factor = ("%", 100.0) if comparison.is_share else ("points", 1.0)
    estimate = comparison.difference.estimate
    p = comparison.difference.p
    low, high = (None if end is None else factor * end for end in (estimate.low, estimate.high))
    numbers = (
        f"{factor * comparison.first:.2f}",
        f"{factor * comparison.second:.2f}",
        f"{factor * estimate.mean:+.2f}",
        interval_cell(low, high, "+.2f"),
        "-" if p is None else f"{p:.4f}",  # a single cluster has neither interval nor p
        str(estimate.n),
        str(comparison.n_unshared),
        *([_drawing_cell(comparison.drawing, factor)] if repeated else ()),
    )
    return Row((comparison.task, comparison.metric, unit, *numbers))


def _drawing_cell(drawing: float | None, factor: float) -> str:
    return "-" if drawing is None else f"±{factor * drawing:.2f}"
