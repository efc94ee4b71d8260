"""The table of pairs of twins."""

from collections.abc import Sequence

from msgspec import UNSET

from infthor_eval.episodes.tables import NAME_COLUMNS
from infthor_eval.plans.summary import PlanTaskSummary
from infthor_eval.rates import format_number, format_percent
from infthor_eval.tables import Column, Row, Table

__all__ = ["twin_tables"]

_COLUMNS = (
    "pairs right",
    "both done",
    "worlds right",
    "one of two",
    "same place",
    "nowhere",
    "opened in vain",
    "excess actions",
    "pairs",
    "incomplete",
)
_NOTE = (
    "Right is who looks first where the object is, in both worlds. Who does not remember looks at "
    "the same place in both, and has 0 pairs; who draws at random has at most 25 %. Containers and "
    "actions are means of worlds."
)


def twin_tables(tasks: Sequence[tuple[str, str, PlanTaskSummary]]) -> list[Table]:
    """Return the table of the tasks whose trajectories are twins; none without such a task."""
    rows = []
    for *names, task in tasks:
        twins = task.twins
        if twins is UNSET:
            continue
        shares = (
            twins.pair_accuracy,
            twins.pair_success,
            twins.accuracy,
            twins.one_of_two,
            twins.same_place,
            twins.nowhere,
        )
        rows.append(
            Row(
                (
                    *names,
                    *map(format_percent, shares),
                    format_number(twins.opened),
                    format_number(twins.excess),
                    str(twins.n_pairs),
                    str(twins.n_incomplete),
                )
            )
        )
    columns = (*NAME_COLUMNS, *map(Column, _COLUMNS))
    return [Table("Twins: first place, % of pairs", columns, tuple(rows), (_NOTE,))] if rows else []
