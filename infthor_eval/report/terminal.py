"""Tables on the terminal."""

import textwrap

from rich import box
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from infthor_eval.tables import Table
from infthor_eval.terminal import console, printable

_LINE = 100  # letters in a line of a note
_WIDTH = 200  # where it is no terminal
_ANY_WIDTH = 10_000


def table_console() -> Console:
    """Return the console of standard output, wide enough for tables of results."""
    return console(width=max(Console().width, _WIDTH))


def print_table(table: Table, on: Console) -> None:
    """Print a table; whatever its cells hold is shown as text.

    On a terminal that is too narrow for it each row is a block with a line per column, so that no
    number is cut off or out of sight.
    """
    rich_table = _rich_table(table)
    options = on.options.update(width=_ANY_WIDTH)
    if on.is_terminal and on.measure(rich_table, options=options).maximum > Console().width:
        _print_blocks(table, on)
    else:
        on.print(rich_table)


def _print_blocks(table: Table, on: Console) -> None:
    if table.title:
        on.print(Text(printable(table.title), style="italic"))
    widest = max(len(column.name) for column in table.columns)
    for row in table.rows:
        on.print()
        for column, cell in zip(table.columns, row.cells, strict=False):
            if cell:
                line = f"  {printable(column.name):<{widest}}  {printable(cell)}"
                on.print(Text(line, style="dim" if row.is_published else ""))
    for note in table.notes:
        on.print()
        on.print(Text(printable(note)))
    on.print()


def _rich_table(table: Table) -> RichTable:
    rich_table = RichTable(
        box=box.SIMPLE_HEAD,
        title=Text(printable(table.title)) if table.title else None,
        title_justify="left",
        caption_justify="left",
    )
    for column in table.columns:
        rich_table.add_column(
            Text(printable(column.name)),
            justify="right" if column.is_number else "left",
            no_wrap=not column.is_number,
            overflow="fold",
        )
    for row in table.rows:
        cells = (Text(printable(cell)) for cell in row.cells)
        style = "dim" if row.is_published else ""
        rich_table.add_row(*cells, style=style, end_section=row.ends_section)
    if table.notes:
        rich_table.caption = Text(
            "\n".join(textwrap.fill(printable(note), _LINE) for note in table.notes)
        )
    return rich_table
