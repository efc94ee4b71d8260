"""Tables as text for other programs: what stands in a cell comes back as it was."""

import csv
import io
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.formats.csv_files import unshield
from infthor_eval.rates import Rate, format_number
from infthor_eval.report.exporting import export_tables
from infthor_eval.report.terminal import print_table
from infthor_eval.tables import Column, Row, Table, TableCell, interval_cell
from infthor_eval.terminal import PlainConsole

# What a table's cell may hold; blanks in a row are one, and control characters are written out.
CELLS = st.text(
    st.characters(categories=("L", "N", "P", "S"), include_characters=" \n"), max_size=12
).map(lambda text: " ".join(text.split()))
TABLES = st.lists(st.tuples(CELLS, CELLS), min_size=1, max_size=4)


def table(rows):
    return Table("", (Column("name", False), Column("number")), tuple(Row(row) for row in rows))


def read_csv(*tables):
    return list(csv.reader(io.StringIO(export_tables(tables, "csv"))))


@given(TABLES)
def test_csv_reads_back(rows):
    texts = Table("", (Column("name", False), Column("text", False)), tuple(map(Row, rows)))
    cells = [[unshield(cell) for cell in row] for row in read_csv(texts)]
    assert cells == [["name", "text"], *map(list, rows)]


@pytest.mark.parametrize("text", ["=1+1", "+A1", "-A1", "@SUM(A1)", '=HYPERLINK("x")', "-3.2+A1"])
def test_no_cell_of_csv_is_a_formula(text):
    rows = (Row((text, text)), Row(("-3.2", "-3.2")), Row(("-", "+1e5")))
    heading, *lines = read_csv(Table("", (Column(text, False), Column("number")), rows))
    assert heading[0] == f"'{text}"
    assert lines == [[f"'{text}"] * 2, ["-3.2", "-3.2"], ["-", "+1e5"]]


@given(st.lists(st.tuples(st.none() | st.floats(-1e6, 1e6), st.floats(0, 10)), max_size=4))
def test_every_number_of_csv_has_a_column_of_its_own_and_a_missing_one_is_empty(values):
    rates = [None if mean is None else Rate(mean,
                                            *((mean - off, mean + off) if off else (None, None)), 7)
             for mean, off in values]  # fmt: skip
    ends = [(None, None) if rate is None else (rate.low, rate.high) for rate in rates]
    columns = (Column("a"), Column("95 %"), Column("n"))
    rows = [Row((format_number(rate), interval_cell(*end, pattern="{}–{}"), "1,234"))
            for rate, end in zip(rates, ends, strict=True)]  # fmt: skip
    heading, *lines = read_csv(Table("", columns, (*rows, Row(("-", "-", "-")))))
    if rows:
        assert heading == ["a", "a low", "a high", "95 % low", "95 % high", "n"]
        for line, rate, (low, high) in zip(lines, rates, ends, strict=False):
            numbers = [None if rate is None else rate.mean, low, high, low, high, 1234]
            assert line == ["" if value is None else f"{value:.1f}" for value in numbers[:5]] + [
                "1234"
            ]
    assert set(lines[-1]) == {""}


def test_a_plain_number_stands_in_the_first_of_several_columns():
    both = TableCell("12.5 (4)", {"": "12.5", "questions": "4"})
    rows = (Row((both,)), Row(("20.25",), is_published=True), Row(("+1.00 =",)))
    assert read_csv(Table("", (Column("one"),), rows))[:3] == [
        ["one", "one questions"],
        ["12.5", "4"],
        ["20.25", ""],
    ]
    assert (
        export_tables([Table("", (Column("one"),), rows)], "markdown").splitlines()[2]
        == "| 12.5 (4) |"
    )


_COMMANDS = {
    r"\textbackslash{}": "\\",
    r"\textasciitilde{}": "~",
    r"\textasciicircum{}": "^",
    r"\textless{}": "<",
    r"\textgreater{}": ">",
    r"\textbar{}": "|",
    **{f"\\{letter}": letter for letter in "&%$#_{}"},
}
_TOKEN = re.compile("|".join(map(re.escape, sorted(_COMMANDS, key=len, reverse=True))))


@given(TABLES)
def test_latex_has_no_letter_that_acts_and_reads_back(rows):
    lines = export_tables([table(rows)], "latex").splitlines()
    assert lines[:2] == [r"\begin{tabular}{lr}", r"\toprule"]
    assert lines[-2:] == [r"\bottomrule", r"\end{tabular}"]
    body = lines[4:-2]
    assert len(body) == len(rows)
    for line, row in zip(body, rows, strict=True):
        cells = line.removesuffix(r" \\").split(" & ")  # an ampersand of a cell is escaped
        assert len(cells) == 2
        for cell, text in zip(cells, row, strict=True):
            assert not re.search(r"[&%$#_{}~^\\]", _TOKEN.sub("", cell))
            assert _TOKEN.sub(lambda token: _COMMANDS[token.group()], cell) == text


@given(TABLES)
def test_markdown_has_as_many_cells_as_the_table_and_reads_back(rows):
    lines = export_tables([table(rows)], "markdown").splitlines()
    assert lines[:2] == ["| name | number |", "| --- | ---: |"]
    assert len(lines) == 2 + len(rows)
    for line, row in zip(lines[2:], rows, strict=True):
        cells = re.split(r"(?<!\\)(?:\\\\)*\|", line)[1:-1]
        assert len(cells) == 2
        unescaped = re.sub(r"\\([\\`*_\[\]<>|~#])", r"\1", line[2:-2])
        assert unescaped == " | ".join(row)


def test_titles_notes_and_published_numbers_are_kept():
    rows = (Row(("a", "1"), ends_section=True), Row(("b",), is_published=True))
    titled = Table("A & B", (Column("name", False), Column("number")), rows, ("50 % of it",))
    latex = export_tables([titled], "latex")
    assert latex.splitlines()[0] == "% A & B"
    assert latex.count(r"\midrule") == 2
    assert r"b &  \\" in latex
    assert latex.rstrip().endswith("% 50 % of it")
    markdown = export_tables([titled, titled], "markdown")
    assert markdown.count("**A & B**") == 2
    assert export_tables([titled], "csv") == "name,number\na,1\nb,\n"
    assert export_tables([titled, titled], "csv").count("# 50 % of it\n") == 2


@pytest.mark.parametrize("form", ["csv", "latex", "markdown"])
def test_a_control_character_is_written_out(form):
    assert "\x1b" not in export_tables([table([("\x1b[31mred", "1")])], form)


def test_on_a_narrow_terminal_a_row_is_a_block(monkeypatch):
    columns = (Column("model", False), Column("total"), Column("folder", False))
    rows = (Row(("m" * 20, "61.20 of 88 answered", "results/" + "f" * 30)),)
    table = Table("Scores", columns, rows, ("A note.",))
    monkeypatch.setenv("COLUMNS", "40")
    shown = io.StringIO()
    print_table(table, PlainConsole(file=shown, force_terminal=True, color_system=None, width=200))
    lines = shown.getvalue().splitlines()
    assert lines[0] == "Scores"
    assert [line.split(maxsplit=1) for line in lines[2:5]] == [
        ["model", "m" * 20],
        ["total", "61.20 of 88 answered"],
        ["folder", "results/" + "f" * 30],
    ]
    assert lines[6] == "A note."
    monkeypatch.setenv("COLUMNS", "120")
    wide = io.StringIO()
    print_table(table, PlainConsole(file=wide, force_terminal=True, color_system=None, width=200))
    lines = wide.getvalue().splitlines()
    assert any("61.20 of 88 answered" in line and "mmm" in line for line in lines)
