"""Runs side by side: their records by unit, and evenly spaced ones of them."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from infthor_eval.run import Run
from infthor_eval.runs import UnitKey, UnitRecord

T = TypeVar("T")


def choose_evenly(items: Sequence[T], n: int) -> list[T]:
    """Return n items, evenly spaced from the first to the last; all if there are no more."""
    if len(items) <= n:
        return list(items)
    return [items[round(number * (len(items) - 1) / max(n - 1, 1))] for number in range(n)]


def records_by_unit(runs: Sequence[Run]) -> Mapping[UnitKey, list[UnitRecord[Any] | None]]:
    """Return the records of each unit, with a place per run, in the order of the units' keys."""
    units: dict[UnitKey, list[UnitRecord[Any] | None]] = {}
    for position, run in enumerate(runs):
        for record in run.records:
            units.setdefault(record.key, [None] * len(runs))[position] = record
    return dict(sorted(units.items()))
