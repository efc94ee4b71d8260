"""CSV files: read strictly (a missing quote swallows no rows), and written without formulas."""

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.reading import first_duplicate, read_text, require_file
from infthor_eval.storage.files import write_atomically
from infthor_eval.storage.limits import CSV_LINE_MB

_FORMULA = ("=", "+", "-", "@", "\t", "\r")  # a cell that begins so is a formula to a spreadsheet
_SHIELD = "'"  # a cell that begins so is text to a spreadsheet
# A number, or a sign alone, is no formula.
_NUMBER = re.compile(r"[+-](?:\d[\d,]*(?:\.\d*)?(?:[eE][+-]?\d+)?)?", re.ASCII)


@dataclass(frozen=True)
class CsvRow:
    """One row.

    Attributes:
        line: number of its last line in the file, from 1.
        columns: names of all columns of the file.
        cells: its cells by column; where it has fewer, those that the file must have are empty.
        problem: the reason why the row cannot be used, and how to fix it; None if it can.
    """

    line: int
    columns: Sequence[str]
    cells: dict[str, str]
    problem: str | None


def read_rows(
    path: Path, columns: Sequence[str], hint: str, *, line_breaks: bool = False
) -> Iterator[CsvRow]:
    """Yield the rows of a CSV file.

    Args:
        path: the file.
        columns: columns that the file must have.
        hint: the way to fix a bad file.
        line_breaks: True if a cell may have several lines; otherwise a line break means an unclosed
            quote.
    """
    _check_lines(path, hint)
    text = read_text(path, hint)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    with wrap_errors(f"{path}: not a UTF-8 CSV file", hint, catch=csv.Error):
        header = next(reader, [])
        _check_header(path, header, columns, hint)
        for cells in reader:
            if not cells:
                continue
            row = dict.fromkeys(columns, "") | dict(zip(header, cells, strict=False))
            problem = None
            broken = next(
                (name for name, cell in row.items() if "\n" in cell or "\r" in cell), None
            )
            if len(cells) > len(header):
                problem = f"has {len(cells)} cells for {len(header)} columns; {hint}"
            elif broken is not None and not line_breaks:
                problem = f"{broken} has several lines; close its quote before the end of the line"
            yield CsvRow(reader.line_num, header, row, problem)


def _check_lines(path: Path, hint: str) -> None:
    """Refuse a line that is too long before the whole file is in memory, and several times over."""
    require_file(path, hint)
    limit = CSV_LINE_MB.value
    longest = limit * 2**20
    with wrap_errors(f"{path}: cannot be read", hint), path.open("rb") as file:
        for number, line in enumerate(iter(partial(file.readline, longest + 1), b""), 1):
            if len(line) > longest:
                raise DataError(
                    f"{path}, line {number}: is longer than {limit} MiB; {CSV_LINE_MB.hint}"
                )


def _check_header(path: Path, header: Sequence[str], columns: Sequence[str], hint: str) -> None:
    missing = [name for name in columns if name not in header]
    if missing:
        raise DataError(f"{path}: no column {', '.join(missing)}; {hint}")
    twice = first_duplicate(filter(None, header))
    if twice is not None:
        raise DataError(f"{path}: column {twice!r} is there twice; remove one")


def write_sheet(path: Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a CSV file for people who open it in a spreadsheet, atomically.

    Raises:
        OSError: the file cannot be written.
    """
    with (
        write_atomically(path) as temporary,
        temporary.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in rows:
            writer.writerow([shield(str(cell)) for cell in row])


def unshield(cell: str) -> str:
    """Return the text that `shield` was given."""
    return (
        cell[1:] if cell.startswith(_SHIELD) and cell[1:].startswith((*_FORMULA, _SHIELD)) else cell
    )


def shield(cell: str) -> str:
    """Return the text that a spreadsheet shows as this one: a formula gets a leading apostrophe.

    A number stays one, whatever its sign.
    """
    if not cell.startswith((*_FORMULA, _SHIELD)) or _NUMBER.fullmatch(cell):
        return cell
    return _SHIELD + cell
