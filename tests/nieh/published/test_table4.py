"""The paper's Table 4 from the published question files, cell by cell."""

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.published import published_tables
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import PublishedColumns, Question
from infthor_eval.nieh.published.table4 import derive_row, table4

from ...helpers.published import PUBLISHED_SETS, needs_published_sets

TABLE = next(table for table in published_tables("nieh") if table.title == "Table 4")
CELLS = [(row, column) for row in TABLE.rows for column in TABLE.columns]


def question(file, number, n_clues, score, **changes):
    matches = tuple((f"match{n}", score) for n in range(1, 5))
    published = PublishedColumns(file, f"t{number}_q0", 1, (0,), changes.get("matches", matches))
    return Question(
        f"t{number}", "Is Mug on the Table?", tuple(range(n_clues)), ("Yes",), published=published
    )


@pytest.fixture
def make_set(tmp_path):
    def make(single, multi):
        write_questions(tmp_path / "qa_set_nieh_single_clue.csv", single)
        write_questions(tmp_path / "qa_set_nsieh_multi_clue.csv", multi)
        return NiehSet(tmp_path)

    return make


SINGLE = (question("single", 1, 1, 1.0), question("single", 2, 2, 0.5))
MULTI = (question("multi", 3, 2, 0.25), question("multi", 4, 3, 0.75), question("multi", 5, 1, 0.0))


def test_columns_are_files_and_clue_frames(make_set):
    cells = derive_row(make_set(SINGLE, MULTI), TABLE.rows[0])
    assert {name: (cell.mean, cell.n) for name, cell in cells.items()} == {
        "1": (0.75, 2), "2": (0.25, 1), ">=3": (0.75, 1), "total": (0.5, 5),
    }  # fmt: skip


def test_printed_numbers_stand_below_ours_and_misprints_are_marked(make_set):
    table = table4(make_set(SINGLE, MULTI))
    assert [row.cells[:2] for row in table.rows[4:6]] == [
        ("Deepseek-VL 7B", "the set's match4"),
        ("Deepseek-VL 7B", "printed"),
    ]
    assert table.rows[4].cells[2:6] == ("75.00 (2)", "25.00 (1)", "75.00 (1)", "50.00 (5)")
    assert table.rows[5].cells[2:6] == ("81.56*", "39.14", "22.57", "62.88")
    assert sum("*" in cell for row in table.rows for cell in row.cells) == 1
    assert "81.56 for 81.65" in table.notes[-1]
    assert table.rows[-1].cells[2:] == ("1: 2", "1: 1", "1: 1")


def test_what_is_missing_is_named(make_set):
    incomplete = question("multi", 6, 4, 1.0, matches=(("match1", 1.0),))
    with pytest.raises(
        DataError, match="no match3 for question t6_q0; give the published question files, with all"
    ):
        table4(make_set(SINGLE, (*MULTI, incomplete)))


@needs_published_sets
@pytest.mark.parametrize(
    ("row", "column"), CELLS, ids=[f"{row.name}, {column}" for row, column in CELLS]
)
def test_every_cell_follows_from_the_published_scores(row, column):
    printed = dict(zip(TABLE.columns, row.values, strict=True))[column]
    derived = 100 * derive_row(NiehSet(PUBLISHED_SETS), row)[column].mean
    assert round(derived, 2) == row.misprints.get(column, printed)
    assert bool(row.misprints.get(column)) == ((row.name, column) == ("Deepseek-VL 7B", "1"))
