"""Tables as a spreadsheet (Office Open XML, .xlsx), which any office program opens."""

from collections.abc import Sequence
from importlib.util import find_spec
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from infthor_eval.errors import UsageError
from infthor_eval.report.exporting import FlatColumn, flat_columns
from infthor_eval.storage.files import prepare_file, write_output
from infthor_eval.tables import Table

if TYPE_CHECKING:
    from xlsxwriter.worksheet import Worksheet

_WIDEST = 60  # characters of a column; longer texts are cut by the program, not in the file
_DIGITS = ".16G"  # as XlsxWriter writes numbers; the greatest floats become infinite by rounding


def prepare_spreadsheet(path: Path) -> Path:
    """Check, before the work starts, that a spreadsheet can be written; create its folder."""
    if find_spec("xlsxwriter") is None:
        raise UsageError("a spreadsheet needs XlsxWriter; pip install 'infthor-eval[xlsx]'")
    return prepare_file(path, "--xlsx")


def write_spreadsheet(path: Path, tables: Sequence[Table]) -> None:
    """Write tables into a prepared file, a sheet each.

    Numbers are numbers there, and no text is taken for a formula or a link. Notes stand below.
    """
    from xlsxwriter import Workbook

    with write_output(path, "give another --xlsx") as partial, Workbook(partial) as book:
        bold = book.add_format({"bold": True})
        for table in tables:
            sheet = book.add_worksheet()
            for place, column in enumerate(flat_columns(table)):
                _write_column(sheet, place, column, bold)
            for row, note in enumerate(table.notes, len(table.rows) + 2):
                sheet.write_string(row, 0, note)
            sheet.freeze_panes(1, 1)


def _write_column(sheet: "Worksheet", place: int, column: FlatColumn, bold: object) -> None:
    sheet.write_string(0, place, column.heading, bold)
    for row, cell in enumerate(column.cells, 1):
        number = _number(cell) if column.is_number else None
        if number is None:
            sheet.write_string(row, place, cell)
        else:
            sheet.write_number(row, place, number)
    width = max(map(len, (column.heading, *column.cells)))
    sheet.set_column(place, place, min(width + 1, _WIDEST))


def _number(cell: str) -> float | None:
    """Return the number of a cell; None if it has none that a spreadsheet can hold."""
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if isfinite(float(format(value, _DIGITS))) else None
