"""Tables as values: what suites say, before it is known whether a terminal or a page shows it."""

from dataclasses import dataclass

__all__ = ["Column", "Row", "Table"]


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
