"""Tables by shown evidence, and the cells of the score above guessing."""

import pytest

from infthor_eval.nieh.records import Guess, ShownClues
from infthor_eval.nieh.results.above_guessing import above_guessing
from infthor_eval.nieh.results.evidence_tables import (
    above_guessing_cell,
    above_guessing_notes,
    evidence_tables,
    short_name,
)

from ..made import identity, record, run_of

SINGLE, MULTI = "qa_set_nieh_single_clue", "qa_set_nsieh_multi_clue"


def asked(number, reply, n_shown, n_after=None, file="", **changes):
    clues = ShownClues(n_shown=n_shown, n_clues=2, n_after=n_after)
    return record(number, reply, shown_clues=clues, file=file, **changes)


def strict(table):
    return [row.cells for row in table.rows if row.cells[3] == "strict"]


def test_by_shown_clues_and_by_distance():
    records = [
        asked(0, "mug", 2, 10),
        asked(1, "cup", 0, 120),
        asked(2, "mug", 0, 120),
        asked(4, "cup", 0, 130),
    ]
    shown, far = evidence_tables([run_of(identity(context="truncate_head", ctx_size=32), records)])
    assert [column.name for column in shown.columns] == [
        "model",
        "task",
        "file",
        "scorer",
        "all",
        "some",
        "none",
    ]
    ((*about, whole, some, none),) = strict(shown)
    assert about == ["a run", "nieh_gt", "total", "strict"]
    assert (whole, some) == ("100.0 (1)", "-")  # one trajectory has no interval
    assert (none.numbers[""], none.numbers["questions"]) == ("33.3", "3")
    assert none == f"33.3 [{none.numbers['low']}, {none.numbers['high']}] (3)"
    assert some.numbers == {"": "", "low": "", "high": "", "questions": ""}
    assert [column.name for column in far.columns[4:]] == ["0-49", "100-199"]
    ((*_, near, distant),) = strict(far)
    assert (near, distant.numbers[""], distant.numbers["questions"]) == ("100.0 (1)", "33.3", "3")


def test_files_have_their_rows_under_short_names():
    records = [asked(0, "mug", 1, file=SINGLE), asked(1, "cup", 2, file=MULTI)]
    (table,) = evidence_tables([run_of(identity(context="trajectory"), records)])
    assert [(row[2], *row[4:]) for row in strict(table)] == [
        ("total", "0.0 (1)", "100.0 (1)", "-"),
        ("nieh_single_clue", "-", "100.0 (1)", "-"),
        ("nsieh_multi_clue", "0.0 (1)", "-", "-"),
    ]
    assert short_name(SINGLE) == "nieh_single_clue"


def test_what_says_nothing_is_left_out():
    everything = [asked(0, "mug", 2, 10)]
    (far,) = evidence_tables([run_of(identity(context="trajectory"), everything)])
    assert "end of the trajectory" in far.title
    assert evidence_tables([run_of(identity(context="clues"), everything)]) == []
    assert evidence_tables([run_of(identity(context="trajectory"), [record(0, "mug")])]) == []


def guessed(number, reply, score, mean=0.5, form="f"):
    return record(
        number,
        reply,
        guess=Guess(form=form, scores={"strict": score}, form_scores={"strict": mean}),
    )


def test_a_cell_has_the_score_above_guessing_with_its_interval():
    records = [guessed(i, "mug" if i % 2 else "cup", 0.25, 0.25) for i in range(8)]
    cell = above_guessing_cell(above_guessing(records, "strict"))
    assert cell.numbers[""] == "33.3"  # (0.5 - 0.25) / 0.75
    assert cell == f"33.3 [{cell.numbers['low']}, {cell.numbers['high']}]"
    assert [above_guessing_cell(none) for none in (None, above_guessing([], "strict"))] == [
        "-",
        "-",
    ]


@pytest.mark.parametrize("n_solved", [0, 2])
def test_the_note_tells_what_is_not_counted(n_solved):
    solved = [guessed(10 + i, "mug", 1.0, 1.0, f"easy {i}") for i in range(n_solved)]
    (note,) = above_guessing_notes([run_of(identity(), [guessed(0, "mug", 0.5), *solved])])
    said = " Not counted, as guessing solves their forms (above 95%): 2 questions of 2 forms."
    assert note.endswith(said) == bool(n_solved)
    assert above_guessing_notes([run_of(identity(), [record(0, "mug"), *solved])]) == []
