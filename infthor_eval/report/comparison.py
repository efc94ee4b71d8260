"""Two runs of one suite on the same units: how their scores differ, with interval and p value.

A unit that was repeated counts with its mean scores, so that runs of different numbers of
repetitions can be compared. Groups of units that are scored together, such as pairs of twins, are
compared as groups too.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, variance
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.report.plain import PlainPresenter
from infthor_eval.report.presenter import GroupScore
from infthor_eval.runs import Suite, UnitKey, UnitRecord
from infthor_eval.statistics import Difference, paired_difference
from infthor_eval.tables import Column, Row, Table, interval_cell

Record = UnitRecord[Any]
Scores = Mapping[str, float]
_NORMAL_95 = 1.96
_LEAST_P = 0.0001


@dataclass(frozen=True)
class Comparison:
    """A metric of a task in two runs.

    Attributes:
        task: name of the task.
        metric: name of the metric.
        is_share: whether the metric is a share, which is shown in percent.
        first: mean score of the first run on the shared units.
        second: mean score of the second run on them.
        difference: second minus first, paired by unit, or by group of units, and clustered.
        n_unshared: number of units, or of groups, that not both runs have a result of; they are not
            compared.
        drawing: half the width of the difference's 95 % interval over other drawings of both runs'
            replies to the same units; None if not every unit was repeated in both, and for groups.
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
    suite: Suite, presenter: PlainPresenter, first: Iterable[Record], second: Iterable[Record]
) -> list[Comparison]:
    """Compare the records of two runs of a suite on the units that both have a result of."""
    firsts = _by_unit(first)
    seconds = _by_unit(second)
    shared = [key for key in firsts if key in seconds]
    if not shared:
        raise DataError(
            "the two runs share no unit of the same task with a result in both; compare runs on "
            "the same data, or with --same-questions"
        )
    comparisons: list[Comparison] = []
    for task in sorted({key.task for key in shared}):
        units = [_PairedUnit(firsts[key], seconds[key]) for key in shared if key.task == task]
        n_unshared = sum(key.task == task for key in firsts.keys() ^ seconds.keys())
        compared = _TaskComparison(presenter, task, n_unshared)
        comparisons += compared.by_groups(_of_task(firsts, task), _of_task(seconds, task))
        comparisons += compared.by_scores(units, suite)
        comparisons += compared.by_extra_scores(units, suite)
    return comparisons


def _by_unit(records: Iterable[Record]) -> dict[UnitKey, list[Record]]:
    """Return the repetitions of each unit that have a result."""
    units: dict[UnitKey, list[Record]] = {}
    for record in records:
        if record.state == "answered":
            units.setdefault(record.key.once, []).append(record)
    return units


def _of_task(units: Mapping[UnitKey, Sequence[Record]], task: str) -> list[Record]:
    return [record for key, records in units.items() if key.task == task for record in records]


@dataclass(frozen=True)
class _PairedUnit:
    """The repetitions of a unit in two runs."""

    first: Sequence[Record]
    second: Sequence[Record]

    def scores(self, scores_of: Callable[[Record], Scores]) -> "_PairedScores":
        cluster = self.first[0].cluster
        return _PairedScores(
            cluster, list(map(scores_of, self.first)), list(map(scores_of, self.second))
        )


@dataclass(frozen=True)
class _PairedScores:
    """The scores of a unit's repetitions in two runs, and its cluster."""

    cluster: str
    first: Sequence[Scores]
    second: Sequence[Scores]

    @property
    def shared_names(self) -> list[str]:
        """Names of the scores that the unit has in both runs."""
        return [name for name in self.first[0] if name in self.second[0]]


@dataclass(frozen=True)
class _TaskComparison:
    """Compares two runs in a task, metric by metric."""

    presenter: PlainPresenter
    task: str
    n_unshared: int

    def by_groups(self, first: Sequence[Record], second: Sequence[Record]) -> Iterator[Comparison]:
        """Compare in the scores of groups of records, on the groups that both runs have."""
        firsts, seconds = (_by_group(self.presenter.group_scores(it)) for it in (first, second))
        shared = [key for key in firsts if key in seconds]
        for metric in dict.fromkeys(metric for metric, _ in shared):
            keys = [key for key in shared if key[0] == metric]
            n_unshared = sum(key[0] == metric for key in firsts.keys() ^ seconds.keys())
            yield self._comparison(
                metric,
                [firsts[key].score for key in keys],
                [seconds[key].score for key in keys],
                [firsts[key].cluster for key in keys],
                n_unshared=n_unshared,
            )

    def by_scores(self, units: Sequence[_PairedUnit], suite: Suite) -> Iterator[Comparison]:
        """Compare in the suite's metrics; one that a unit has not is 0."""
        scores = [unit.scores(suite.scores) for unit in units]
        for metric in _shared_metrics(scores):
            yield self._compare(metric, scores)

    def by_extra_scores(self, units: Sequence[_PairedUnit], suite: Suite) -> Iterator[Comparison]:
        """Compare in scores that not every unit has, whatever it was replied: in those of the units
        with a result, if there are any."""
        further = [unit.scores(self.presenter.extra_scores) for unit in units]
        scored = []
        for unit, scores in zip(units, further, strict=True):
            if suite.scores(unit.first[0]) and suite.scores(unit.second[0]):
                scored.append(scores)
        names: dict[str, None] = {}
        for scores in scored or further:
            names |= dict.fromkeys(scores.shared_names)
        for metric in names:
            chosen = []
            most = []
            for unit, scores in zip(units, further, strict=True):
                if metric in scores.shared_names:
                    chosen.append(scores)
                    low, high = self.presenter.extra_ranges(unit.first[0])[metric]
                    most.append(high - low)
            yield self._compare(metric, chosen, fmean(most))

    def _compare(
        self, metric: str, scores: Sequence[_PairedScores], most: float | None = None
    ) -> Comparison:
        firsts = [_values(unit.first, metric) for unit in scores]
        seconds = [_values(unit.second, metric) for unit in scores]
        return self._comparison(
            metric,
            list(map(fmean, firsts)),
            list(map(fmean, seconds)),
            [unit.cluster for unit in scores],
            n_unshared=self.n_unshared,
            drawing=_drawing([*firsts, *seconds], len(scores)),
            most=most,
        )

    def _comparison(
        self,
        metric: str,
        first: Sequence[float],
        second: Sequence[float],
        clusters: Sequence[str],
        *,
        n_unshared: int,
        drawing: float | None = None,
        most: float | None = None,
    ) -> Comparison:
        """Compare scores in one order; `most` is the largest possible difference of the means, 1 by
        default where all scores are shares."""
        if most is None and min(*first, *second) >= 0 and max(*first, *second) <= 1:
            most = 1.0
        return Comparison(
            task=self.task,
            metric=metric,
            is_share=self.presenter.is_share(metric, [*first, *second]),
            first=sum(first) / len(first),
            second=sum(second) / len(second),
            difference=paired_difference(first, second, clusters, most),
            n_unshared=n_unshared,
            drawing=drawing,
        )


def _by_group(scores: Iterable[GroupScore]) -> dict[tuple[str, str], GroupScore]:
    """Return scores by metric and group."""
    return {(score.metric, score.group): score for score in scores}


def _shared_metrics(scores: Sequence[_PairedScores]) -> list[str]:
    """Return the metrics of both runs; all of the other's if one has no unit with a result."""
    first: dict[str, None] = {}
    second: dict[str, None] = {}
    for unit in scores:
        for repetition in unit.first:
            first |= dict.fromkeys(repetition)
        for repetition in unit.second:
            second |= dict.fromkeys(repetition)
    if not first or not second:
        return list(first or second)
    return [name for name in first if name in second]


def _values(scores: Sequence[Scores], metric: str) -> list[float]:
    return [of_repetition.get(metric, 0.0) for of_repetition in scores]


def _drawing(samples: Sequence[Sequence[float]], n_units: int) -> float | None:
    """Return `Comparison.drawing` of the scores of each unit in each run."""
    if any(len(values) < 2 for values in samples):
        return None
    spread = math.sqrt(sum(variance(values) / len(values) for values in samples))
    return _NORMAL_95 * spread / n_units


_DRAWING_NOTE = "drawing: what the difference moves by if both are asked the same again (95 %)."


def comparison_table(comparisons: Sequence[Comparison], first: str, second: str) -> Table:
    """Return a table by task and metric, in its own unit; `first` and `second` name the runs."""
    repeated = any(comparison.drawing is not None for comparison in comparisons)
    numbers = ["first", "second", "difference", "95 % interval", "p", "samples", "not in both"]
    numbers += ["drawing"] if repeated else []
    notes = (
        f"first: {first}; second: {second}; difference: the second minus the first.",
        *((_DRAWING_NOTE,) if repeated else ()),
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
    low = None if estimate.low is None else factor * estimate.low
    high = None if estimate.high is None else factor * estimate.high
    numbers = (
        f"{factor * comparison.first:.2f}",
        f"{factor * comparison.second:.2f}",
        f"{factor * estimate.mean:+.2f}",
        interval_cell(low, high, "+.2f"),
        p_cell(p),
        str(estimate.n),
        str(comparison.n_unshared),
        *([_drawing_cell(comparison.drawing, factor)] if repeated else ()),
    )
    return Row((comparison.task, comparison.metric, unit, *numbers))


def p_cell(p: float | None) -> str:
    """Return a p value in words; a single cluster has none."""
    if p is None:
        return "-"
    return f"{p:.4f}" if p >= _LEAST_P else f"< {_LEAST_P}"


def _drawing_cell(drawing: float | None, factor: float) -> str:
    return "-" if drawing is None else f"±{factor * drawing:.2f}"
