"""What is left of a memory as its evidence grows older, and its half-life.

Twins are asked the same question at growing ages, but not all at all ages: the changed thing is
seen again, or the episode ends. Those that are left at great ages may be harder or easier, so net
pairs of different questions are not compared. From one age to the next, what is kept is the ratio
of net pairs of the questions that are asked at both; the curve is the product of these ratios
(docs/reference/metrics.md).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import msgspec
import numpy as np

_HALF = 0.5
_N_RESAMPLES = 2000
_FEWEST = 20  # questions asked at an age and the one before; of fewer a ratio says nothing
_ENDS = [0.025, 0.975]  # of 95 % intervals


class Kept(msgspec.Struct, frozen=True):
    """What is left at an age of the net pairs at the first one: 1 there.

    Attributes:
        age: number of frames since the evidence.
        share: what is left.
        low, high: its 95 % interval over bases; None at the first age and with one base.
        n: number of questions that were asked at this age and the one before.
    """

    age: int
    share: float
    low: float | None
    high: float | None
    n: int


class Retention(msgspec.Struct, frozen=True):
    """What is left of a memory at each age, and when it is half.

    Attributes:
        kept: what is left, by age, ascending.
        half_life: the two ages between which the half is passed, the second None where it never is
            up to the last age; None where nothing is known at the first age to be kept.
        low, high: 95 % interval of the age at which it is passed, between two ages by interpolation
            on a logarithmic axis; None for an end beyond the last age.
    """

    kept: tuple[Kept, ...]
    half_life: tuple[int, int | None] | None
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Ladder:
    """A paired question on one evidence.

    Attributes:
        cluster: what its worlds were made of.
        net: its net score by age.
    """

    cluster: str
    net: Mapping[int, float]


def retention_of(ladders: Sequence[Ladder], seed: int = 0) -> Retention | None:
    """Return the retention of a reader, up to the age before which too few questions are left.

    It is None if too few were asked at the first two ages.
    """
    ages = sorted({age for ladder in ladders for age in ladder.net})
    sums = [_sums(ladders, *ages_) for ages_ in pairwise(ages)]
    reached = next((at for at, it in enumerate(sums) if it.n < _FEWEST), len(sums))
    if not reached:
        return None
    del ages[reached + 1 :], sums[reached:]
    clusters = sorted({ladder.cluster for ladder in ladders})
    table = np.stack([it.table(clusters) for it in sums], axis=1)
    shares = _curve(table.sum(axis=0))
    draws = np.random.default_rng(seed).multinomial(
        len(clusters), [1 / len(clusters)] * len(clusters), size=_N_RESAMPLES
    )
    totals = np.einsum("rc,cab->rab", draws, table)
    resampled = _curve(totals)
    has_interval = len(clusters) > 1
    ends = np.quantile(resampled, _ENDS, axis=0)
    kept = [Kept(ages[0], 1.0, None, None, sums[0].n)]
    for at, age in enumerate(ages[1:], 1):
        low, high = map(float, ends[:, at]) if has_interval else (None, None)
        kept.append(Kept(age, float(shares[at]), low, high, sums[at - 1].n))
    at_first = np.quantile(totals[:, 0, 0], _ENDS[0]) if has_interval else table[:, 0, 0].sum()
    if at_first <= 0:
        return Retention(tuple(kept), None)
    passed = next((at for at, share in enumerate(shares) if share <= _HALF), None)
    bracket = (ages[-1], None) if passed is None else (ages[passed - 1], ages[passed])
    low, high = _half_life_interval(ages, resampled) if has_interval else (None, None)
    return Retention(tuple(kept), bracket, low, high)


@dataclass(frozen=True)
class _Sums:
    """Sums of net scores at two ages by cluster, over the n questions that were asked at both."""

    by_cluster: Mapping[str, tuple[float, float]]
    n: int

    def table(self, clusters: Sequence[str]) -> np.ndarray:
        """Return the sums of these clusters at both ages, [clusters, 2]."""
        return np.array([self.by_cluster.get(name, (0.0, 0.0)) for name in clusters])


def _sums(ladders: Sequence[Ladder], age: int, following: int) -> _Sums:
    both = [it for it in ladders if age in it.net and following in it.net]
    by_cluster: dict[str, tuple[float, float]] = {}
    for ladder in both:
        first, second = by_cluster.get(ladder.cluster, (0.0, 0.0))
        by_cluster[ladder.cluster] = first + ladder.net[age], second + ladder.net[following]
    return _Sums(by_cluster, len(both))


def _curve(totals: np.ndarray) -> np.ndarray:
    """Return what is left at each age, [..., ages], from sums at two in a row, [..., ages - 1, 2].

    Where nothing was known at the first of both, nothing can be kept.
    """
    first = totals[..., 0]
    second = totals[..., 1]
    ratios = np.where(first > 0, np.maximum(second, 0) / np.where(first > 0, first, 1), 0.0)
    left = np.cumprod(ratios, axis=-1)
    return np.concatenate([np.ones_like(left[..., :1]), left], axis=-1)


def _half_life_interval(
    ages: Sequence[int], curves: np.ndarray
) -> tuple[float | None, float | None]:
    lives = _half_lives(ages, curves)
    # Not interpolated between two resamples: one of them may be endless.
    ends = np.quantile(lives, _ENDS, method="inverted_cdf")
    low, high = (None if math.isinf(end) else float(end) for end in ends)
    return low, high


def _half_lives(ages: Sequence[int], curves: np.ndarray) -> np.ndarray:
    """Return the age at which each curve passes one half, infinity if it does not."""
    is_past = curves <= _HALF
    after = np.maximum(is_past.argmax(axis=1), 1)
    rows = np.arange(len(curves))
    start = curves[rows, after - 1]
    end = curves[rows, after]
    drop = np.where(is_past.any(axis=1), start - end, 1.0)
    times = np.log(ages)
    passed = times[after - 1] + (start - _HALF) / drop * (times[after] - times[after - 1])
    return np.where(is_past.any(axis=1), np.exp(passed), np.inf)
