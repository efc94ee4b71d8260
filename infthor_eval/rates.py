"""Means with their intervals, as summaries store them and tables show them.

`statistics` is imported where it is needed: it loads scipy, and listing runs does without.
"""

from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING

import msgspec

from infthor_eval.tables import TableCell, interval_cell

if TYPE_CHECKING:
    from infthor_eval.statistics import MeanEstimate

__all__ = [
    "Rate",
    "clustered_rate",
    "format_number",
    "format_percent",
    "paired_rate",
    "rate_over_clusters",
]


class Rate(msgspec.Struct, frozen=True):
    """The mean of n values and its 95 % interval by trajectory (None with fewer than two)."""

    mean: float
    low: float | None
    high: float | None
    n: int


def clustered_rate(values: Sequence[float], clusters: Sequence[Hashable]) -> Rate | None:
    """Return the mean of the values of units (see `clustered_mean`), or None if there are none."""
    from infthor_eval.statistics import clustered_mean

    return _rate(clustered_mean(values, clusters)) if values else None


def rate_over_clusters(values: Sequence[float]) -> Rate | None:
    """Return the mean of one value per cluster (see `mean_over_clusters`); None without any."""
    from infthor_eval.statistics import mean_over_clusters

    return _rate(mean_over_clusters(values)) if values else None


def paired_rate(
    first: Sequence[float], second: Sequence[float], clusters: Sequence[Hashable]
) -> Rate | None:
    """Return the mean of second minus first, paired (see `paired_difference`); None without any."""
    from infthor_eval.statistics import paired_difference

    return _rate(paired_difference(first, second, clusters).estimate) if first else None


def format_percent(rate: Rate | None) -> TableCell:
    """Return a share as a table cell, in percent."""
    return _format(rate, 100.0)


def format_number(rate: Rate | None) -> TableCell:
    """Return a number as a table cell."""
    return _format(rate, 1.0)


def _rate(estimate: "MeanEstimate") -> Rate:
    return Rate(estimate.mean, estimate.low, estimate.high, estimate.n)


def _format(rate: Rate | None, factor: float) -> TableCell:
    if rate is None:
        return TableCell("-", {"": "", "low": "", "high": ""})
    mean = f"{factor * rate.mean:.1f}"
    low, high = (None if end is None else factor * end for end in (rate.low, rate.high))
    interval = interval_cell(low, high)
    return TableCell(mean if low is None else f"{mean} {interval}", {"": mean, **interval.numbers})
