"""Which units of a run were answered, which failed, and which were not asked.

A score is over the answered ones alone (docs/reference/metrics.md), so whoever shows one shows too
whether a run is whole.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import msgspec

from infthor_eval.quantities import Count
from infthor_eval.runs.journals.records import RunHeader, UnitRecord


class UnitCounts(msgspec.Struct, frozen=True, kw_only=True):
    """Numbers of a task's units by state.

    Attributes:
        answered: those with a result.
        failed: those whose request or episode failed.
        not_asked: those that a stopped run did not come to, or that a cap left out.
        excluded: those that nobody can do, which count nowhere.
    """

    answered: Count = 0
    failed: Count = 0
    not_asked: Count = 0
    excluded: Count = 0

    @property
    def is_whole(self) -> bool:
        """Whether all units that can be done have a result."""
        return not self.failed and not self.not_asked


def count_units(header: RunHeader, records: Sequence[UnitRecord[Any]]) -> dict[str, UnitCounts]:
    """Return the numbers of units of each task by state.

    Those that a stopped run did not come to are known by the header, except of older runs of
    several tasks and of those that no driver made.
    """
    states = Counter((record.task, record.state) for record in records)
    recorded = Counter(record.task for record in records)
    counts = {}
    for task in header.config.tasks:
        n_missing = max(0, _units_of_task(header, task, recorded[task]) - recorded[task])
        counts[task] = UnitCounts(
            answered=states[task, "answered"],
            failed=states[task, "failed"],
            not_asked=states[task, "not asked"] + n_missing,
            excluded=states[task, "excluded"],
        )
    return counts


def _units_of_task(header: RunHeader, task: str, n_recorded: int) -> int:
    if header.units_by_task:
        return header.units_by_task.get(task, n_recorded)
    is_alone = len(header.config.tasks) == 1
    return header.n_units if is_alone and header.n_units is not None else n_recorded
