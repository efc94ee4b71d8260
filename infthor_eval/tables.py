"""Tables as values, which a terminal, a page or a file shows."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

_N_REASONS = 5  # reasons that a table lists

Reasons = Mapping[str, int]


class TableCell(str):
    """Text of a cell that holds several numbers, and each of them for files.

    Attributes:
        numbers: the numbers by name, as text; the main one has an empty name, missing ones are
            empty.
    """

    __slots__ = ("numbers",)
    numbers: Mapping[str, str]

    def __new__(cls, text: str, numbers: Mapping[str, str]) -> Self:
        """Return a cell with that text and those numbers."""
        cell = super().__new__(cls, text)
        cell.numbers = numbers
        return cell


def interval_cell(
    low: float | None, high: float | None, number_format: str = ".1f", pattern: str = "[{}, {}]"
) -> TableCell:
    """Return an interval's cell, its formatted ends in the pattern; `-` if there is none."""
    if low is None or high is None:
        return TableCell("-", {"low": "", "high": ""})
    ends = {"low": f"{low:{number_format}}", "high": f"{high:{number_format}}"}
    return TableCell(pattern.format(*ends.values()), ends)


def answered_cell(mean: str, n_answered: int, n_all: int) -> TableCell:
    """Return the cell of a mean over the units with a result; it says if these are not all, and a
    mean over none has no number."""
    if n_answered == n_all:
        return TableCell(mean, {"": mean})
    if not n_answered:
        return TableCell("none answered", {"": "", "answered": "0"})
    return TableCell(f"{mean} of {n_answered} answered", {"": mean, "answered": str(n_answered)})


@dataclass(frozen=True)
class Column:
    """A column with its heading; numbers are aligned on the right."""

    name: str
    is_number: bool = True


@dataclass(frozen=True)
class Row:
    """A row: a text per column (missing ones at the end are empty), published or our own.

    Attributes:
        ends_section: True if a line is drawn below it.
        link: address that its first cell leads to on a page; empty for none.
    """

    cells: tuple[str, ...]
    is_published: bool = False
    ends_section: bool = False
    link: str = ""


@dataclass(frozen=True)
class Table:
    """A table with columns, a title of one line (or empty), and notes below, a paragraph each."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()


def left_out_notes(runs: Sequence[Sequence[tuple[Reasons, Reasons]]]) -> list[str]:
    """Return notes on units that do not count, by reason.

    Args:
        runs: for each run and each of its tasks the number of excluded and of skipped units, by
            reason. The tasks of a run read the same files and runs side by side leave out the same,
            so these are not added up over runs.
    """
    reasons: Counter[str] = Counter()
    for tasks in runs:
        excluded = sum((Counter(of_task) for of_task, _ in tasks), Counter[str]())
        reasons |= excluded | Counter(
            {reason: n for _, skipped in tasks for reason, n in skipped.items()}
        )
    counts = sorted(reasons.items())
    more = (
        [f"{len(counts) - _N_REASONS} more reasons to leave out"]
        if len(counts) > _N_REASONS
        else []
    )
    return [f"{n} left out: {reason}" for reason, n in counts[:_N_REASONS]] + more
