"""Spreadsheets, read by a library that did not write them."""

import sys

import openpyxl
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from infthor_eval.errors import DataError, UsageError
from infthor_eval.report.spreadsheet import prepare_spreadsheet, write_spreadsheet
from infthor_eval.tables import Column, Row, Table, interval_cell


def read(path):
    """Return the rows of each sheet, as values and as types of cells."""
    book = openpyxl.load_workbook(path)
    return [
        [[(cell.value, cell.data_type) for cell in row] for row in sheet.iter_rows()]
        for sheet in book
    ]


def test_numbers_are_numbers_and_each_has_a_column_of_its_own(tmp_path):
    columns = (Column("run", False), Column("%"), Column("95 % interval"), Column("samples"))
    rows = (
        Row(("12", "-3.5", interval_cell(-10, 2.5), "1,234")),
        Row(("model", "-", interval_cell(None, None), "-")),
    )
    write_spreadsheet(tmp_path / "table.xlsx", [Table("", columns, rows, ("a note",))])
    (sheet,) = read(tmp_path / "table.xlsx")
    assert ",".join(cell for cell, _ in sheet[0]) == (
        "run,%,95 % interval low,95 % interval high,samples"
    )
    assert sheet[1] == [("12", "s"), (-3.5, "n"), (-10, "n"), (2.5, "n"), (1234, "n")]
    assert [cell or "" for cell, _ in sheet[2]] == ["model", "", "", "", ""]
    assert sheet[4][0] == ("a note", "s")


@pytest.mark.parametrize(
    "text", ["=1+1", "{=A1}", "+A1", "@SUM(A1)", '=HYPERLINK("x")', "http://x.y"]
)
def test_no_text_is_a_formula_or_a_link(tmp_path, text):
    columns = (Column(text, False), Column("number"))
    write_spreadsheet(tmp_path / "a.xlsx", [Table("", columns, (Row((text, text)),))])
    sheet = openpyxl.load_workbook(tmp_path / "a.xlsx").active
    for cell in (sheet["A1"], sheet["A2"], sheet["B2"]):
        assert (cell.value, cell.data_type, cell.hyperlink) == (text, "s", None)


@settings(max_examples=30)
@example(sys.float_info.max)
@example(-sys.float_info.max)
@given(st.floats(allow_nan=True, allow_infinity=True))
def test_whatever_a_number_is_the_file_can_be_opened(tmp_path_factory, value):
    path = tmp_path_factory.mktemp("sheet") / "a.xlsx"
    write_spreadsheet(path, [Table("", (Column("number"),), (Row((repr(value),)),))])
    (sheet,) = read(path)
    found = sheet[1][0][0]
    assert found == repr(value) or found == pytest.approx(value, rel=1e-15)  # of 16 digits


def test_tables_are_sheets(tmp_path):
    table = Table("", (Column("a", False),), (Row(("x",)),))
    write_spreadsheet(tmp_path / "a.xlsx", [table, table])
    assert len(read(tmp_path / "a.xlsx")) == 2


def test_what_cannot_be_written_is_one_line(tmp_path):
    table = Table("", (Column("a", False),), ())
    with pytest.raises(DataError, match=r"cannot be written.*give another --xlsx"):
        write_spreadsheet(tmp_path / "none" / "a.xlsx", [table])


def test_what_a_spreadsheet_needs_is_looked_for_first(tmp_path, monkeypatch):
    (tmp_path / "a.xlsx").mkdir()
    with pytest.raises(DataError, match=r"not a file; give another place with --xlsx"):
        prepare_spreadsheet(tmp_path / "a.xlsx")
    monkeypatch.setitem(sys.modules, "xlsxwriter", None)
    with pytest.raises(UsageError, match=r"pip install 'infthor-eval\[xlsx\]'"):
        prepare_spreadsheet(tmp_path / "b.xlsx")
