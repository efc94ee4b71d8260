"""Tables on the terminal."""

from rich import box
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from infthor_eval.tables import Column, Row, Table

__all__ = ["print_table", "table_console"]

_WIDTH = 180  # on a narrower terminal lines wrap; cut-off numbers would be worse


def table_console() -> Console:
    """Standard output for tables of results."""
    return Console(soft_wrap=True, width=max(Console().width, _WIDTH))


def print_table(table: Table, console: Console) -> None:
    """Show a table; whatever its cells hold is shown as text."""
    shown = RichTable(
        box=box.SIMPLE_HEAD,
        title=Text(table.title) if table.title else None,
        title_justify="left",
        caption_justify="left",
    )
    for column in table.columns:
        _add_column(shown, column)
    for row in table.rows:
        _add_row(shown, row)
    if table.notes:
        shown.caption = Text("\n".join(table.notes))
    console.print(shown)


def _add_column(shown: RichTable, column: Column) -> None:
    if column.is_number:
        shown.add_column(Text(column.name), justify="right", overflow="fold")
    else:
        shown.add_column(Text(column.name), no_wrap=True, overflow="fold")


def _add_row(shown: RichTable, row: Row) -> None:
    shown.add_row(*map(Text, row.cells), style="dim" if row.is_published else "")
    if row.ends_section:
        shown.add_section()
