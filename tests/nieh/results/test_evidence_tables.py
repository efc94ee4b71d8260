"""Tables by shown evidence, and the cells of the score above blind."""

import pytest

from infthor_eval.nieh.records import BlindGuess, ShownClues
from infthor_eval.nieh.results.above_blind import above_blind
from infthor_eval.nieh.results.evidence_tables import (
    above_blind_cell,
    above_blind_notes,
    question_facet_tables,
    short_name,
)

from ...helpers.nieh_runs import make_config, make_record, make_run

SINGLE, MULTI = "qa_set_nieh_single_clue", "qa_set_nsieh_multi_clue"


def make_evidence_record(number, reply, n_shown, n_after=None, file="", **changes):
    clues = ShownClues(n_shown=n_shown, n_clues=2, n_after=n_after)
    return make_record(number, reply, shown_clues=clues, file=file, **changes)


def strict(table):
    return [row.cells for row in table.rows if row.cells[3] == "strict"]


def test_by_shown_clues_and_by_distance():
    records = [
        make_evidence_record(0, "mug", 2, 10),
        make_evidence_record(1, "cup", 0, 120),
        make_evidence_record(2, "mug", 0, 120),
        make_evidence_record(4, "cup", 0, 130),
    ]
    by_clues, by_distance = question_facet_tables(
        [make_run(make_config(context="truncate_head", ctx_size=32), records)]
    )
    assert " ".join(it.name for it in by_clues.columns) == "model task file scorer all some none"
    ((*about, whole, some, none),) = strict(by_clues)
    assert about == ["a run", "nieh_gt", "total", "strict"]
    assert (whole, some) == ("100.0 (1)", "-")  # one trajectory has no interval
    assert (none.numbers[""], none.numbers["questions"]) == ("33.3", "3")
    assert none == f"33.3 [{none.numbers['low']}, {none.numbers['high']}] (3)"
    assert some.numbers == {"": "", "low": "", "high": "", "questions": ""}
    assert [column.name for column in by_distance.columns[4:]] == ["0-49", "100-199"]
    ((*_, near, distant),) = strict(by_distance)
    assert (near, distant.numbers[""], distant.numbers["questions"]) == ("100.0 (1)", "33.3", "3")


def test_files_have_their_rows_under_short_names():
    records = [
        make_evidence_record(0, "mug", 1, file=SINGLE),
        make_evidence_record(1, "cup", 2, file=MULTI),
    ]
    (table,) = question_facet_tables([make_run(make_config(context="trajectory"), records)])
    assert [(row[2], *row[4:]) for row in strict(table)] == [
        ("total", "0.0 (1)", "100.0 (1)", "-"),
        ("nieh_single_clue", "-", "100.0 (1)", "-"),
        ("nsieh_multi_clue", "0.0 (1)", "-", "-"),
    ]
    assert short_name(SINGLE) == "nieh_single_clue"


def test_what_says_nothing_is_left_out():
    everything = [make_evidence_record(0, "mug", 2, 10)]
    (far,) = question_facet_tables([make_run(make_config(context="trajectory"), everything)])
    assert "end of the trajectory" in far.title
    assert question_facet_tables([make_run(make_config(context="clues"), everything)]) == []
    unknown = make_run(make_config(context="trajectory"), [make_record(0, "mug")])
    assert question_facet_tables([unknown]) == []


def guessed(number, reply, score, mean=0.5, form="f"):
    return make_record(
        number,
        reply,
        blind=BlindGuess(form=form, scores={"strict": score}, form_scores={"strict": mean}),
    )


def test_a_cell_has_the_score_above_blind_with_its_interval():
    records = [guessed(i, "mug" if i % 2 else "cup", 0.25, 0.25) for i in range(8)]
    cell = above_blind_cell(above_blind(records, "strict"))
    assert cell.numbers[""] == "33.3"  # (0.5 - 0.25) / 0.75
    assert cell == f"33.3 [{cell.numbers['low']}, {cell.numbers['high']}]"
    assert [above_blind_cell(it) for it in (None, above_blind([], "strict"))] == ["-"] * 2


@pytest.mark.parametrize("n_solved", [0, 2])
def test_the_note_tells_what_is_not_counted(n_solved):
    solved = [guessed(10 + i, "mug", 1.0, 1.0, f"easy {i}") for i in range(n_solved)]
    (note,) = above_blind_notes([make_run(make_config(), [guessed(0, "mug", 0.5), *solved])])
    expected = " Not counted, as blind solves their forms (above 95%): 2 questions of 2 forms."
    assert note.endswith(expected) == bool(n_solved)
    unknown = [make_record(0, "mug"), make_record(1, "mug")]
    assert above_blind_notes([make_run(make_config(), [*unknown, *solved])]) == []
