"""Means of scores with 95 % intervals that are clustered by trajectory.

Questions on one trajectory share its frames, scene and objects, so their scores are correlated. The
independent unit is the trajectory. Every interval here sums or resamples over trajectories, through
one partition (`_partition`).

To add or change an interval: here; `benchmarks/interval_coverage.py` measures it.
"""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import scipy  # its submodules are imported at their first use

from infthor_eval.errors import DataError

_LEVEL = 0.95
_ROUNDING = 1e-12


@dataclass(frozen=True)
class MeanEstimate:
    """The mean of n scores, its clustered standard error and 95 % interval, symmetric or not.

    Error and interval are None with fewer than two clusters.
    """

    mean: float
    stderr: float | None
    low: float | None
    high: float | None
    n: int
    n_clusters: int


@dataclass(frozen=True)
class Difference:
    """The mean difference of two runs on the same questions, second minus first.

    `p` is the two-sided p-value of the clustered t statistic; None with fewer than two clusters.
    """

    estimate: MeanEstimate
    p: float | None


def clustered_mean(scores: Sequence[float], clusters: Sequence[Hashable]) -> MeanEstimate:
    """Return the mean with a cluster-robust standard error and a 95 % interval.

    If all scores lie between 0 and 1, the interval is of Wilson's type on the effective sample
    size, so it stays valid near 0 and 1 and is not empty where all scores are equal. Other scores
    (the reference scorer can exceed 1) get a t interval with `n_clusters - 1` degrees of freedom.

    Raises:
        DataError: there is no score, or a score has no cluster.
    """
    totals, sizes = _partition(scores, clusters)
    estimate = _with_t_interval(totals, sizes)
    if estimate.stderr is None or min(scores) < 0 or max(scores) > 1:
        return estimate
    low, high = _wilson(estimate.mean, _effective_size(estimate))
    return replace(estimate, low=low, high=high)


def mean_over_clusters(values: Sequence[float]) -> MeanEstimate:
    """Return mean and t interval of values, one per cluster (such as rewards of trajectories).

    Unlike `clustered_mean`, this never takes values for shares: the points of a reward curve that
    happen to lie between 0 and 1 get the same kind of interval as all others.

    Raises:
        DataError: there is no value.
    """
    return _with_t_interval(*_partition(values, range(len(values))))


def _with_t_interval(totals: np.ndarray, sizes: np.ndarray) -> MeanEstimate:
    n = int(sizes.sum())
    n_clusters = len(sizes)
    mean = float(totals.sum() / n)
    if n_clusters < 2:
        return MeanEstimate(mean, None, None, None, n, n_clusters)
    # Clusters differ in size, so the mean is a ratio of two random sums. This linearises the ratio
    # (Taylor): the residual of a cluster is its total minus what the mean predicts for its size.
    residuals = totals - mean * sizes
    stderr = math.sqrt(n_clusters / (n_clusters - 1) * float(residuals @ residuals)) / n
    margin = _t_quantile(n_clusters) * stderr
    return MeanEstimate(mean, stderr, mean - margin, mean + margin, n, n_clusters)


@cache
def _t_quantile(n_clusters: int) -> float:
    # Not scipy.stats, which takes a second to import and gives the same quantiles.
    return float(scipy.special.stdtrit(n_clusters - 1, 0.5 + _LEVEL / 2))


@cache
def _normal_quantile() -> float:
    return float(scipy.special.ndtri(0.5 + _LEVEL / 2))


def _effective_size(estimate: MeanEstimate) -> float:
    """Return the number of independent questions that would give as much information.

    It is the number of questions over the design effect, the factor by which clustering inflates
    the variance. The coverage of the resulting interval is measured by
    `benchmarks/interval_coverage.py`.
    """
    # If each cluster is right or wrong as a whole, a cluster counts as one question.
    worst = estimate.n / estimate.n_clusters
    variance = estimate.mean * (1 - estimate.mean)
    stderr = estimate.stderr or 0.0
    # At least 1: clusters that happen to be more alike than chance are no evidence for more than
    # `n` questions.
    measured = max(1.0, stderr**2 * estimate.n / variance) if variance > 0 else worst
    # The effect is itself estimated on few clusters, which widens the interval as in a t interval.
    measured *= (_t_quantile(estimate.n_clusters) / _normal_quantile()) ** 2
    # Only the rarer outcome tells how strongly clusters agree. Where it is rare, the measured
    # effect is unreliable and the worst case gets more weight: that of one question beside `n_rare`
    # observed ones.
    n_rare = estimate.n * min(estimate.mean, 1 - estimate.mean)
    return estimate.n / ((n_rare * measured + worst) / (n_rare + 1))


def _wilson(mean: float, n: float) -> tuple[float, float]:
    """Return Wilson's interval of a share of `n` questions (Wilson 1927; z: normal quantile).

    centre = (mean + z²/2n) / (1 + z²/n), margin = z / (1 + z²/n) * sqrt(mean (1 - mean) / n +
    z²/4n²)
    """
    spread = _normal_quantile() ** 2 / n
    centre = (mean + spread / 2) / (1 + spread)
    margin = _normal_quantile() / (1 + spread) * math.sqrt(mean * (1 - mean) / n + spread / (4 * n))
    # The interval holds the mean and lies within [0, 1] exactly; rounding alone could break both at
    # 0 and 1.
    return max(0.0, min(mean, centre - margin)), min(1.0, max(mean, centre + margin))


def bootstrap_interval(
    scores: Sequence[float], clusters: Sequence[Hashable], seed: int = 0, n_resamples: int = 2000
) -> tuple[float, float] | None:
    """Return the 95 % percentile interval of the mean over resampled clusters.

    It is None where resampling has nothing to vary: with fewer than two clusters, or if all have
    one mean. The same seed and the same order of clusters give the same interval.

    Raises:
        DataError: as in `clustered_mean`.
    """
    totals, sizes = _partition(scores, clusters)
    if len(sizes) < 2 or np.ptp(totals / sizes) < _ROUNDING:
        return None
    picks = np.random.default_rng(seed).integers(len(sizes), size=(n_resamples, len(sizes)))
    means = totals[picks].sum(axis=1) / sizes[picks].sum(axis=1)
    low, high = np.quantile(means, [0.5 - _LEVEL / 2, 0.5 + _LEVEL / 2])
    return float(low), float(high)


def paired_difference(
    first: Sequence[float],
    second: Sequence[float],
    clusters: Sequence[Hashable],
    most: float | None = None,
) -> Difference:
    """Return the mean of second minus first: two runs' scores on the same questions in one order.

    Args:
        most: largest possible distance of the two means, 1 for shares; the interval is cut off
            there, which loses no truth. None if there is none.

    Raises:
        DataError: the runs differ in length, or as in `clustered_mean`.
    """
    if len(first) != len(second):
        raise DataError(
            f"{len(first)} and {len(second)} scores cannot be paired; compare runs on the same "
            "questions"
        )
    totals, sizes = _partition([b - a for a, b in zip(first, second, strict=True)], clusters)
    estimate = _with_t_interval(totals, sizes)
    stderr = estimate.stderr
    if stderr is None:
        return Difference(estimate, None)
    if most is not None:
        estimate = _within(estimate, -most, most)
    # Every question differs by the same amount: either by nothing, or never by chance.
    if stderr == 0:
        return Difference(estimate, 1.0 if estimate.mean == 0 else 0.0)
    t = abs(estimate.mean / stderr)
    return Difference(estimate, float(2 * scipy.special.stdtr(estimate.n_clusters - 1, -t)))


def _within(estimate: MeanEstimate, least: float, most: float) -> MeanEstimate:
    """Return an estimate whose interval ends where its values do; it holds the mean in any case."""
    assert estimate.low is not None and estimate.high is not None
    low = min(max(estimate.low, least), estimate.mean)
    high = max(min(estimate.high, most), estimate.mean)
    return replace(estimate, low=low, high=high)


def _partition(
    scores: Sequence[float], clusters: Sequence[Hashable]
) -> tuple[np.ndarray, np.ndarray]:
    """Return sum of scores and number of questions per cluster, the base of all else here."""
    if not scores:
        raise DataError("there is no score to take the mean of")
    if len(scores) != len(clusters):
        raise DataError(
            f"{len(scores)} scores but {len(clusters)} trajectories; each score needs its "
            "trajectory"
        )
    for index, cluster in enumerate(clusters):
        if cluster is None or cluster == "":
            raise DataError(f"score {index} has no trajectory; intervals cluster by it")
    indices = {cluster: index for index, cluster in enumerate(dict.fromkeys(clusters))}
    cluster_of = np.array([indices[cluster] for cluster in clusters])
    return np.bincount(cluster_of, weights=np.asarray(scores, dtype=float)), np.bincount(
        cluster_of
    ).astype(float)
