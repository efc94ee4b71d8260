"""The table of pairs of twins."""

from collections.abc import Sequence

from msgspec import UNSET, UnsetType

from infthor_eval.episodes.tables import NAME_COLUMNS
from infthor_eval.plans.summary import PlanTaskSummary
from infthor_eval.plans.twins.results import TwinResults
from infthor_eval.rates import format_number, format_percent
from infthor_eval.tables import Column, Row, Table, TableCell

NET_PAIRS = "net pairs, %"
_COLUMNS = (
    NET_PAIRS,
    "right, %",
    "exchanged, %",
    "both done, %",
    "worlds right, %",
    "one of two, %",
    "same place, %",
    "nowhere, %",
    "opened in vain",
    "excess actions",
    "pairs",
    "incomplete",
)
_NOTE = (
    "A pair is right if the agent looks first where the object is, in both worlds, and exchanged "
    "if it looks first where the object is in the other world, in both. net pairs: right less "
    "exchanged, with the 95 % bootstrap interval over trajectories; 0 on average for an agent that "
    "does not know which world is which. Containers and actions are means of worlds."
)


def format_pairs(twins: TwinResults | UnsetType) -> TableCell:
    """Return the cell of the net pairs."""
    return format_percent(None if twins is UNSET else twins.net_pairs)


def twin_tables(tasks: Sequence[tuple[str, str, PlanTaskSummary]]) -> list[Table]:
    """Return the table of the tasks whose trajectories are twins; none without such a task."""
    rows = []
    for *names, task in tasks:
        twins = task.twins
        if twins is UNSET:
            continue
        shares = (
            twins.net_pairs,
            twins.pair_accuracy,
            twins.pairs_exchanged,
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
    return (
        [Table("Twins: the place looked at first", columns, tuple(rows), (_NOTE,))] if rows else []
    )
