"""How sure a mean score is, when questions on one trajectory are not independent.

Questions share their trajectory's frames, scene and objects, so they are right or wrong together; the unit that
repeats is the trajectory. Every interval here resamples or sums over trajectories, through one partition.
"""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy import special  # not stats, which takes a second to import and comes to the same

from infthor_eval.errors import DataError

__all__ = [
    "Difference",
    "MeanEstimate",
    "bootstrap_interval",
    "clustered_mean",
    "mean_over_clusters",
    "paired_difference",
]

_LEVEL = 0.95


@dataclass(frozen=True)
class MeanEstimate:
    """A mean and how sure it is.

    Attributes:
        mean: the mean score.
        stderr: its standard error, clustered; None with fewer than two clusters.
        low: lower end of the 95 % interval, which need not be symmetric; None as above.
        high: upper end.
        n: number of scores.
        n_clusters: number of clusters.
    """

    mean: float
    stderr: float | None
    low: float | None
    high: float | None
    n: int
    n_clusters: int


@dataclass(frozen=True)
class Difference:
    """The mean difference of two runs on the same questions, and the probability of one so large by chance.

    Attributes:
        estimate: of the differences, second minus first.
        p: two-sided, from the clustered t statistic; None with fewer than two clusters.
    """

    estimate: MeanEstimate
    p: float | None


def clustered_mean(scores: Sequence[float], clusters: Sequence[Hashable]) -> MeanEstimate:
    """The mean with a cluster-robust standard error, and an interval that stays honest near all right and all wrong.

    Scores from 0 to 1 get Wilson's interval on the effective sample size, which is not zero wide where all are equal;
    others (the reference scorer can exceed 1) and differences a t interval, of clusters minus one degrees of freedom.

    Args:
        scores: one per question.
        clusters: the trajectory of each.

    Raises:
        DataError: there is no score, or a score without its cluster.
    """
    totals, sizes = _partition(scores, clusters)
    estimate = _with_t_interval(totals, sizes)
    if estimate.stderr is None or min(scores) < 0 or max(scores) > 1:
        return estimate
    low, high = _wilson(estimate.mean, _effective_size(estimate))
    return replace(estimate, low=low, high=high)


def mean_over_clusters(values: Sequence[float]) -> MeanEstimate:
    """The mean of numbers of which each cluster has one (a trajectory's reward), with a t interval.

    Unlike `clustered_mean` it takes no number for a share: points of a curve that happen to lie between 0 and 1 get the
    same kind of interval as those that do not.

    Args:
        values: one per cluster.

    Raises:
        DataError: there is none.
    """
    return _with_t_interval(*_partition(values, range(len(values))))


def _with_t_interval(totals: np.ndarray, sizes: np.ndarray) -> MeanEstimate:
    n, n_clusters = int(sizes.sum()), len(sizes)
    mean = float(totals.sum() / n)
    if n_clusters < 2:
        return MeanEstimate(mean, None, None, None, n, n_clusters)
    # Residual of each cluster's total: the ratio estimator's linearisation, as clusters differ in size.
    residuals = totals - mean * sizes
    stderr = math.sqrt(n_clusters / (n_clusters - 1) * float(residuals @ residuals)) / n
    reach = _quantile(n_clusters) * stderr
    return MeanEstimate(mean, stderr, mean - reach, mean + reach, n, n_clusters)


@cache
def _quantile(n_clusters: int) -> float:
    return float(special.stdtrit(n_clusters - 1, 0.5 + _LEVEL / 2))


_NORMAL_QUANTILE = float(special.ndtri(0.5 + _LEVEL / 2))


def _effective_size(estimate: MeanEstimate) -> float:
    """How many independent questions tell as much.

    The design effect says how much clustering inflates the variance; it is measured on few clusters, which counts
    against it as in a t interval. It shows in the questions that are not like the others: the fewer there are, the more
    weight its worst value gets, that of clusters which are right or wrong as a whole. What comes of it is shown by
    `benchmarks/interval_coverage.py`.
    """
    worst = estimate.n / estimate.n_clusters
    variance, stderr = estimate.mean * (1 - estimate.mean), estimate.stderr or 0.0
    measured = max(1.0, stderr**2 * estimate.n / variance) if variance > 0 else worst
    measured *= (_quantile(estimate.n_clusters) / _NORMAL_QUANTILE) ** 2
    n_unlike = estimate.n * min(estimate.mean, 1 - estimate.mean)
    return estimate.n / ((n_unlike * measured + worst) / (n_unlike + 1))


def _wilson(mean: float, n: float) -> tuple[float, float]:
    """Wilson's score interval of a share among `n` questions."""
    spread = _NORMAL_QUANTILE**2 / n
    centre = (mean + spread / 2) / (1 + spread)
    reach = _NORMAL_QUANTILE / (1 + spread) * math.sqrt(mean * (1 - mean) / n + spread / (4 * n))
    return max(0.0, min(mean, centre - reach)), min(1.0, max(mean, centre + reach))


def bootstrap_interval(
    scores: Sequence[float], clusters: Sequence[Hashable], seed: int = 0, n_resamples: int = 2000
) -> tuple[float, float] | None:
    """The 95 % percentile interval of the mean over resampled clusters.

    None where resampling tells nothing: of fewer than two clusters, or scores that are all alike.

    Raises:
        DataError: as in `clustered_mean`.
    """
    totals, sizes = _partition(scores, clusters)
    if len(sizes) < 2 or min(scores) == max(scores):
        return None
    picks = np.random.default_rng(seed).integers(len(sizes), size=(n_resamples, len(sizes)))
    means = totals[picks].sum(axis=1) / sizes[picks].sum(axis=1)
    low, high = np.quantile(means, [0.5 - _LEVEL / 2, 0.5 + _LEVEL / 2])
    return float(low), float(high)


def paired_difference(first: Sequence[float], second: Sequence[float], clusters: Sequence[Hashable]) -> Difference:
    """How much better the second run is on the same questions.

    Args:
        first: scores of the first run.
        second: scores of the second run, in the same order.
        clusters: the trajectory of each question.

    Raises:
        DataError: the runs differ in length, and as in `clustered_mean`.
    """
    if len(first) != len(second):
        raise DataError(f"{len(first)} and {len(second)} scores cannot be paired; compare runs on the same questions")
    totals, sizes = _partition([b - a for a, b in zip(first, second, strict=True)], clusters)
    estimate = _with_t_interval(totals, sizes)
    if estimate.stderr is None:
        return Difference(estimate, None)
    if estimate.stderr == 0:
        return Difference(estimate, 1.0 if estimate.mean == 0 else 0.0)
    t = abs(estimate.mean / estimate.stderr)
    return Difference(estimate, float(2 * special.stdtr(estimate.n_clusters - 1, -t)))


def _partition(scores: Sequence[float], clusters: Sequence[Hashable]) -> tuple[np.ndarray, np.ndarray]:
    """Sum of scores and number of questions per cluster; everything above is computed from these alone."""
    if not scores:
        raise DataError("there is no score to take the mean of")
    if len(scores) != len(clusters):
        raise DataError(f"{len(scores)} scores but {len(clusters)} trajectories; each score needs its trajectory")
    for index, cluster in enumerate(clusters):
        if cluster is None or cluster == "":
            raise DataError(f"score {index} has no trajectory; intervals cluster by it")
    numbers = {cluster: number for number, cluster in enumerate(dict.fromkeys(clusters))}
    of = np.array([numbers[cluster] for cluster in clusters])
    return np.bincount(of, weights=np.asarray(scores, dtype=float)), np.bincount(of).astype(float)
