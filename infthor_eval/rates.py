"""Means with their intervals, as summaries keep them and tables show them.

What reckons them is imported where it is needed: runs are listed without it.
"""

from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING

import msgspec

if TYPE_CHECKING:
    from infthor_eval.statistics import MeanEstimate

__all__ = ["Rate", "clustered_rate", "format_number", "format_percent", "rate_over_clusters"]


class Rate(msgspec.Struct, frozen=True):
    """A mean with its 95 % interval, clustered by trajectory.

    Attributes:
        mean: the mean.
        low: lower end; None with fewer than two trajectories.
        high: upper end.
        n: how many it is over.
    """

    mean: float
    low: float | None
    high: float | None
    n: int


def clustered_rate(values: Sequence[float], clusters: Sequence[Hashable]) -> Rate | None:
    """The mean of values of units, see `clustered_mean`; None of nothing."""
    from infthor_eval.statistics import clustered_mean

    return _rate(clustered_mean(values, clusters)) if values else None


def rate_over_clusters(values: Sequence[float]) -> Rate | None:
    """The mean of numbers of which each cluster has one, see `mean_over_clusters`; None of nothing."""
    from infthor_eval.statistics import mean_over_clusters

    return _rate(mean_over_clusters(values)) if values else None


def format_percent(rate: Rate | None) -> str:
    """A share in a table's cell, in percent."""
    return "-" if rate is None else _written(rate, 100.0)


def format_number(rate: Rate | None) -> str:
    """A number in a table's cell."""
    return "-" if rate is None else _written(rate, 1.0)


def _rate(estimate: "MeanEstimate") -> Rate:
    return Rate(estimate.mean, estimate.low, estimate.high, estimate.n)


def _written(rate: Rate, factor: float) -> str:
    mean = f"{factor * rate.mean:.1f}"
    if rate.low is None or rate.high is None:
        return mean
    return f"{mean} [{factor * rate.low:.1f}, {factor * rate.high:.1f}]"
