"""Tables on the terminal."""

import textwrap

from rich import box
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from infthor_eval.tables import Column, Row, Table
from infthor_eval.terminal import console, printable

__all__ = ["print_table", "table_console"]

_LINE = 100  # of a note
_WIDTH = 180  # on a narrower terminal lines wrap; cut-off numbers would be worse


def table_console() -> Console:
    """Standard output for tables of results."""
    return console(width=max(Console().width, _WIDTH))


def print_table(table: Table, on: Console) -> None:
    """Show a table; whatever its cells hold is shown as text."""
    drawn = RichTable(
        box=box.SIMPLE_HEAD,
        title=Text(printable(table.title)) if table.title else None,
        title_justify="left",
        caption_justify="left",
    )
    for column in table.columns:
        _add_column(drawn, column)
    for row in table.rows:
        _add_row(drawn, row)
    if table.notes:
        drawn.caption = Text("\n".join(textwrap.fill(printable(note), _LINE) for note in table.notes))
    on.print(drawn)


def _add_column(drawn: RichTable, column: Column) -> None:
    if column.is_number:
        drawn.add_column(Text(printable(column.name)), justify="right", overflow="fold")
    else:
        drawn.add_column(Text(printable(column.name)), no_wrap=True, overflow="fold")


def _add_row(drawn: RichTable, row: Row) -> None:
    drawn.add_row(*(Text(printable(cell)) for cell in row.cells), style="dim" if row.is_published else "")
    if row.ends_section:
        drawn.add_section()
