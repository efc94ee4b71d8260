"""Tables as values: what suites say, before it is known whether a terminal or a page shows it."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

__all__ = ["Column", "Row", "Table", "told_left_out"]

_TOLD = 5  # reasons that a table tells of

Reasons = Mapping[str, int]


@dataclass(frozen=True)
class Column:
    """A column.

    Attributes:
        name: its heading.
        is_number: whether its cells line up on the right.
    """

    name: str
    is_number: bool = True


@dataclass(frozen=True)
class Row:
    """A row.

    Attributes:
        cells: a text per column; missing ones at the end are empty.
        is_published: whether its numbers are somebody else's.
        ends_section: whether a line is drawn below it.
    """

    cells: tuple[str, ...]
    is_published: bool = False
    ends_section: bool = False


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        title: one line; empty for none.
        columns: at least one.
        rows: in the order shown.
        notes: what must be said with it, a paragraph each.
    """

    title: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()


def told_left_out(runs: Sequence[Sequence[tuple[Reasons, Reasons]]]) -> list[str]:
    """Notes on what does not count, by reason.

    Args:
        runs: of each run, of each of its tasks: what was excluded, and what was skipped, by reason. The tasks of a run
            read the same files, and runs side by side leave out the same.
    """
    reasons: Counter[str] = Counter()
    for tasks in runs:
        excluded = sum((Counter(one) for one, _ in tasks), Counter[str]())
        reasons |= excluded | Counter({reason: n for _, skipped in tasks for reason, n in skipped.items()})
    told = sorted(reasons.items())
    more = [f"{len(told) - _TOLD} more reasons to leave out"] if len(told) > _TOLD else []
    return [f"{n} left out: {reason}" for reason, n in told[:_TOLD]] + more
