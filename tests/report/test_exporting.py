"""Tables as text for other programs: what stands in a cell comes back as it was."""

import csv
import io
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.report.exporting import exported
from infthor_eval.tables import Column, Row, Table

# What a table's cell may hold; blanks in a row are one, and control characters are written out.
CELLS = st.text(st.characters(categories=("L", "N", "P", "S"), include_characters=" \n"), max_size=12).map(
    lambda text: " ".join(text.split())
)
TABLES = st.lists(st.tuples(CELLS, CELLS), min_size=1, max_size=4)


def table(rows):
    return Table("", (Column("name", False), Column("number")), tuple(Row(row) for row in rows))


@given(TABLES)
def test_csv_reads_back(rows):
    assert list(csv.reader(io.StringIO(exported([table(rows)], "csv")))) == [["name", "number"], *map(list, rows)]


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
    lines = exported([table(rows)], "latex").splitlines()
    assert lines[:2] == [r"\begin{tabular}{lr}", r"\toprule"]
    assert lines[-2:] == [r"\bottomrule", r"\end{tabular}"]
    body = lines[4:-2]
    assert len(body) == len(rows)
    for line, row in zip(body, rows, strict=True):
        cells = line.removesuffix(r" \\").split(" & ")  # an ampersand of a cell is escaped
        assert len(cells) == 2
        for cell, text in zip(cells, row, strict=True):
            assert not re.search(r"[&%$#_{}~^\\]", _TOKEN.sub("", cell))
            assert _TOKEN.sub(lambda found: _COMMANDS[found.group()], cell) == text


@given(TABLES)
def test_markdown_has_as_many_cells_as_the_table_and_reads_back(rows):
    lines = exported([table(rows)], "markdown").splitlines()
    assert lines[:2] == ["| name | number |", "| --- | ---: |"]
    assert len(lines) == 2 + len(rows)
    for line, row in zip(lines[2:], rows, strict=True):
        cells = re.split(r"(?<!\\)(?:\\\\)*\|", line)[1:-1]
        assert len(cells) == 2
        unescaped = re.sub(r"\\([\\`*_\[\]<>|~#])", r"\1", line[2:-2])
        assert unescaped == " | ".join(row)


def test_titles_notes_and_published_numbers_are_kept():
    rows = (Row(("a", "1"), ends_section=True), Row(("b",), is_published=True))
    told = Table("A & B", (Column("name", False), Column("number")), rows, ("50 % of it",))
    latex = exported([told], "latex")
    assert latex.splitlines()[0] == "% A & B"
    assert latex.count(r"\midrule") == 2
    assert r"b &  \\" in latex
    assert latex.rstrip().endswith("% 50 % of it")
    markdown = exported([told, told], "markdown")
    assert markdown.count("**A & B**") == 2
    assert exported([told], "csv") == "name,number\na,1\nb,\n"
    assert exported([told, told], "csv").count("# 50 % of it\n") == 2


@pytest.mark.parametrize("form", ["csv", "latex", "markdown"])
def test_a_control_character_is_written_out(form):
    assert "\x1b" not in exported([table([("\x1b[31mred", "1")])], form)
