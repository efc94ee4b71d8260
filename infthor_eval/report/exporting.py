"""Tables as text for other programs: CSV, LaTeX (booktabs), Markdown; and by columns."""

import csv
import io
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

from infthor_eval.formats.csv_files import shield
from infthor_eval.tables import Column, Table, TableCell
from infthor_eval.terminal import printable

_LATEX = str.maketrans(
    {
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "|": r"\textbar{}",
        **{letter: f"\\{letter}" for letter in "&%$#_{}"},
    }
)
_MARKDOWN = re.compile(r"([\\`*_\[\]<>|~#])")
_THOUSANDS = re.compile(r"(?<=\d),(?=\d{3}(?!\d))")


def export_tables(tables: Sequence[Table], file_format: str) -> str:
    """Return tables in a form, separated by empty lines.

    Args:
        tables: tables with at least one column each.
        form: csv, latex or markdown. In CSV a cell holds one number: a cell with several (an
            interval, a count) becomes several columns, and a text that a spreadsheet would take for
            a formula begins with an apostrophe. The title and the notes are lines that begin with
            `#`; a table alone has none.
    """
    if file_format == "csv":
        return "\n".join(_csv(table, with_words=len(tables) > 1) for table in tables)
    return "\n".join(
        {"latex": _latex, "markdown": _markdown}[file_format](table) for table in tables
    )


def _csv(table: Table, *, with_words: bool) -> str:
    text = io.StringIO()
    words = [word for word in (table.title, *table.notes) if word] if with_words else []
    text.writelines(f"# {_in_one_line(word)}\n" for word in words)
    columns = [[column.heading, *column.cells] for column in flat_columns(table)]
    rows = ([shield(cell) for cell in row] for row in zip(*columns, strict=True))
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


@dataclass(frozen=True)
class FlatColumn:
    """A column of cells that hold one number or one text each.

    Attributes:
        heading: name of the column, and of the number where a cell of the table held several.
        is_number: whether its cells are numbers; those that are missing are empty.
        cells: a cell for each row, in one line.
    """

    heading: str
    is_number: bool
    cells: Sequence[str]


def flat_columns(table: Table) -> Iterator[FlatColumn]:
    """Yield the columns of a table, a column for each of the numbers that a cell holds."""
    for column, *cells in zip(table.columns, *_cells(table), strict=True):
        named = (cell.numbers for cell in cells if isinstance(cell, TableCell))
        names = list(dict.fromkeys(chain.from_iterable(named))) or [""]
        for at, name in enumerate(names):
            flat = [_flat_cell(cell, name, column, is_first=at == 0) for cell in cells]
            yield FlatColumn(_in_one_line(f"{column.name} {name}"), column.is_number, flat)


def _flat_cell(cell: str, name: str, column: Column, *, is_first: bool) -> str:
    if isinstance(cell, TableCell):
        return cell.numbers.get(name, "")
    if not is_first:
        return ""
    text = _in_one_line(cell)
    if not column.is_number:
        return text
    return "" if text == "-" else _THOUSANDS.sub("", text)


def _in_one_line(text: str) -> str:
    return " ".join(printable(text).split())


def _cells(table: Table) -> list[list[str]]:
    """Return the cells of each row, one per column."""
    width = len(table.columns)
    return [[*row.cells, *[""] * width][:width] for row in table.rows]


def _rows(table: Table, escape: Callable[[str], str]) -> list[list[str]]:
    """Return the heading and the rows, with escaped cells of one line each."""
    texts = [[column.name for column in table.columns], *_cells(table)]
    return [[escape(_in_one_line(cell)) for cell in cells] for cells in texts]


def _latex(table: Table) -> str:
    heading, *rows = _rows(table, lambda text: text.translate(_LATEX))
    aligned = "".join("r" if column.is_number else "l" for column in table.columns)
    lines = [rf"\begin{{tabular}}{{{aligned}}}", r"\toprule", _latex_row(heading), r"\midrule"]
    for cells, row in zip(rows, table.rows, strict=True):
        lines += [
            _latex_row(cells),
            *([r"\midrule"] if row.ends_section and cells is not rows[-1] else []),
        ]
    lines += [
        r"\bottomrule",
        r"\end{tabular}",
        *(f"% {_in_one_line(note)}" for note in table.notes),
    ]
    title = [f"% {_in_one_line(table.title)}"] if table.title else []
    return "\n".join([*title, *lines]) + "\n"


def _latex_row(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"


def _markdown(table: Table) -> str:
    heading, *rows = _rows(table, _markdown_text)
    rule = ["---:" if column.is_number else "---" for column in table.columns]
    title = [f"**{_markdown_text(table.title)}**", ""] if table.title else []
    lines = [f"| {' | '.join(cells)} |" for cells in (heading, rule, *rows)]
    notes = [line for note in table.notes for line in ("", _markdown_text(_in_one_line(note)))]
    return "\n".join([*title, *lines, *notes]) + "\n"


def _markdown_text(text: str) -> str:
    return _MARKDOWN.sub(r"\\\1", text)
