"""The scores of a run's tasks as other formats have them: a mean, its interval, and each sample's.

They are those of `show` and `results.json`: a unit that was repeated counts with its mean; one that
failed or is excluded is in no score.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import fmean
from typing import Any, NamedTuple

from infthor_eval.errors import DataError
from infthor_eval.run import Run
from infthor_eval.runs import UnitRecord
from infthor_eval.statistics import MeanEstimate, bootstrap_interval, clustered_mean

LEVEL = 0.95  # of all intervals

Record = UnitRecord[Any]


class Scored(NamedTuple):
    """A sample with its score: a unit, or a group of units such as a pair of twins.

    Attributes:
        name: id of the unit with its variant, or name of the group.
        cluster: what intervals cluster by.
        score: mean over its repetitions.
        repetitions: record and score of each; none of a group.
    """

    name: str
    cluster: str
    score: float
    repetitions: Sequence[tuple[Record, float]] = ()


@dataclass(frozen=True)
class Measure:
    """A metric of a task.

    Attributes:
        task: name of the task.
        metric: name of the metric.
        is_primary: whether it is the task's primary metric.
        is_share: whether it is a share, from 0 to 1.
        bounds: lowest and highest possible score.
        samples: the samples that count, in the order of their keys.
        resampled: whether the interval is over resampled clusters.
    """

    task: str
    metric: str
    is_primary: bool
    is_share: bool
    bounds: tuple[float, float]
    samples: Sequence[Scored]
    resampled: bool = False

    @cached_property
    def estimate(self) -> MeanEstimate:
        """Mean, standard error and interval, clustered by trajectory; without, of one cluster."""
        scores = [sample.score for sample in self.samples]
        return clustered_mean(scores, [sample.cluster for sample in self.samples])

    @property
    def interval(self) -> tuple[float, float] | None:
        """The 95 % interval; None with fewer than two clusters."""
        estimate = self.estimate
        if self.resampled:
            scores = [sample.score for sample in self.samples]
            return bootstrap_interval(scores, [sample.cluster for sample in self.samples])
        if estimate.low is None or estimate.high is None:
            return None
        return estimate.low, estimate.high

    @property
    def method(self) -> str:
        """How the interval was computed, in words."""
        if self.resampled:
            return "percentiles over resampled trajectories (bootstrap)"
        scores = [sample.score for sample in self.samples]
        if min(scores) < 0 or max(scores) > 1:
            return "t interval, clustered by trajectory"
        return "Wilson interval on the effective sample size, clustered by trajectory"


def counted(run: Run, task: str) -> list[Record]:
    """Return the records of a task that are not excluded, in the order of their keys."""
    records = (it for it in run.records if it.task == task and it.excluded is None)
    return sorted(records, key=lambda record: record.key)


def scored(run: Run, task: str) -> list[Record]:
    """Return those of them that did not fail."""
    return [record for record in counted(run, task) if record.failure is None]


def find_measures(run: Run) -> dict[str, list[Measure]]:
    """Return the metrics of each task with a unit that has a score, the primary one first."""
    found = {task: measures for task in run.tasks if (measures := _measures_of(run, task))}
    if not found:
        raise DataError(f"{run.folder}: no unit of it has a score; leave it out, or run it again")
    return found


def _measures_of(run: Run, task: str) -> list[Measure]:
    records = scored(run, task)
    return [
        *_groups(run, task, records),
        *_metrics(run, task, records),
        *_further(run, task, records),
    ]


def _groups(run: Run, task: str, records: Sequence[Record]) -> Iterator[Measure]:
    by_metric: dict[str, list[Scored]] = {}
    for it in run.presenter.group_scores(records):
        by_metric.setdefault(it.metric, []).append(Scored(it.group, it.cluster, it.score))
    for number, (metric, samples) in enumerate(by_metric.items()):
        # As in our tables: the interval of a difference is over resampled clusters.
        resampled = run.presenter.bounds(metric)[0] < 0
        is_primary = number == 0
        yield _measure(run, task, metric, samples, is_primary=is_primary, resampled=resampled)


def _metrics(run: Run, task: str, records: Sequence[Record]) -> Iterator[Measure]:
    main = run.presenter.main_metric
    scores = [run.suite.scores(record) for record in records]
    names = list(dict.fromkeys(name for of_record in scores for name in of_record))
    names.sort(key=lambda name: name != main)
    has_groups = any(True for _ in run.presenter.group_scores(records))
    for number, name in enumerate(names):
        values = [of_record.get(name, 0.0) for of_record in scores]
        samples = _by_unit(list(zip(records, values, strict=True)))
        is_primary = number == 0 and not has_groups
        yield _measure(run, task, name, samples, is_primary=is_primary)


def _further(run: Run, task: str, records: Sequence[Record]) -> Iterator[Measure]:
    """Yield the scores that only some samples have."""
    by_metric: dict[str, list[tuple[Record, float]]] = {}
    for record in records:
        for name, score in run.presenter.extra_scores(record).items():
            by_metric.setdefault(name, []).append((record, score))
    for metric, scored in by_metric.items():
        yield _measure(run, task, metric, _by_unit(scored), resampled=True)


def _by_unit(scored: Sequence[tuple[Record, float]]) -> list[Scored]:
    """Return the mean score of each unit."""
    units: dict[str, list[tuple[Record, float]]] = {}
    for record, score in scored:
        units.setdefault(str(record.key.once), []).append((record, score))
    return [
        Scored(name, same[0][0].cluster, fmean(score for _, score in same), same)
        for name, same in units.items()
    ]


def _measure(
    run: Run,
    task: str,
    metric: str,
    samples: Sequence[Scored],
    *,
    is_primary: bool = False,
    resampled: bool = False,
) -> Measure:
    scores = [sample.score for sample in samples]
    return Measure(
        task=task,
        metric=metric,
        is_primary=is_primary,
        is_share=run.presenter.is_share(metric, scores),
        bounds=run.presenter.bounds(metric),
        samples=samples,
        resampled=resampled,
    )
