"""Means with their intervals, as summaries store them and tables show them.

`statistics` is imported where it is needed: it loads scipy, and listing runs does without.
"""

from collections.abc import Hashable, Sequence
from statistics import fmean
from typing import TYPE_CHECKING

import msgspec

from infthor_eval.tables import TableCell, answered_cell, interval_cell

if TYPE_CHECKING:
    from infthor_eval.statistics import MeanEstimate


class Rate(msgspec.Struct, frozen=True, omit_defaults=True):
    """The mean of n values and its 95 % interval by trajectory (None with fewer than two).

    `n_all` is the number of units that were to have a value; None if all of them have one.
    `all_equal`: all trajectories have this mean, so resampling them finds no interval.
    """

    mean: float
    low: float | None
    high: float | None
    n: int
    n_all: int | None = None
    all_equal: bool = False

    def out_of(self, n_all: int) -> "Rate":
        """Return the same mean as that of some of `n_all` units."""
        return msgspec.structs.replace(self, n_all=n_all if n_all > self.n else None)


def clustered_rate(values: Sequence[float], clusters: Sequence[Hashable]) -> Rate | None:
    """Return the mean of the values of units (see `clustered_mean`), or None if there are none."""
    from infthor_eval.statistics import clustered_mean

    return _rate(clustered_mean(values, clusters)) if values else None


def rate_over_clusters(values: Sequence[float]) -> Rate | None:
    """Return the mean of one value per cluster (see `mean_over_clusters`); None without any."""
    from infthor_eval.statistics import mean_over_clusters

    return _rate(mean_over_clusters(values)) if values else None


def paired_rate(
    first: Sequence[float],
    second: Sequence[float],
    clusters: Sequence[Hashable],
    most: float | None = None,
) -> Rate | None:
    """Return the mean of second minus first, paired (see `paired_difference`); None without any."""
    from infthor_eval.statistics import paired_difference

    return _rate(paired_difference(first, second, clusters, most).estimate) if first else None


def resampled_rate(values: Sequence[float], clusters: Sequence[Hashable]) -> Rate | None:
    """Return the mean with the bootstrap interval over clusters (see `bootstrap_interval`).

    Of values of any sign, such as differences. None without any.
    """
    from infthor_eval.statistics import bootstrap_interval

    if not values:
        return None
    low, high = bootstrap_interval(values, clusters) or (None, None)
    all_equal = low is None and len(set(clusters)) > 1
    return Rate(fmean(values), low, high, len(values), all_equal=all_equal)


def format_percent(rate: Rate | None, n_all: int = 0) -> TableCell:
    """Return a share as a table cell, in percent; `n_all` units were to have a value."""
    return _format(rate, 100.0, n_all)


def format_number(rate: Rate | None, n_all: int = 0) -> TableCell:
    """Return a number as a table cell; `n_all` units were to have a value."""
    return _format(rate, 1.0, n_all)


def _rate(estimate: "MeanEstimate") -> Rate:
    return Rate(estimate.mean, estimate.low, estimate.high, estimate.n)


def _format(rate: Rate | None, factor: float, n_all: int) -> TableCell:
    if rate is None:
        return (
            answered_cell("", 0, n_all)
            if n_all
            else TableCell("-", {"": "", "low": "", "high": ""})
        )
    mean = answered_cell(f"{factor * rate.mean:.1f}", rate.n, rate.n_all or rate.n)
    low, high = (None if end is None else factor * end for end in (rate.low, rate.high))
    interval = interval_cell(low, high)
    numbers = {"": mean.numbers[""], **interval.numbers, **mean.numbers}
    shown = "[all equal]" if rate.all_equal else "" if low is None else interval
    return TableCell(f"{mean} {shown}".rstrip(), numbers)
