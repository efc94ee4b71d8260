"""The file of pairs, and the columns of paired questions."""

import msgspec
import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import encode_questions, read_questions, write_questions
from infthor_eval.formats.question import Question
from infthor_eval.formats.twins import (
    ComparedFrame,
    PairedQuestion,
    TwinPair,
    read_pairs,
    write_pairs,
)
from tests.helpers.twin_sets import write_twin_set

QUESTION = PairedQuestion(
    "Was the fridge open?", "Was {} open?", "open_state", "open_state: Fridge",
    (("yes",), ("no",)), (1, 2), ((1,), (2,)), (False, False), (0.0, 0.0),
)  # fmt: skip
PAIR = TwinPair(
    "state-1", "state", 0, "abc", ("kitchen-1-a", "kitchen-1-b"), "kitchen-1",
    {"Mug|1": "Mug|2"}, ("Mug|1",), (), ("Mug",),
    (ComparedFrame(True), ComparedFrame(False, ("Mug|1",))), (QUESTION,),
)  # fmt: skip


def test_pairs_are_read_as_written(tmp_path):
    write_pairs(tmp_path, [PAIR, PAIR])
    assert read_pairs(tmp_path) == [PAIR, PAIR]


@pytest.mark.parametrize("line", [b"{}", b"no", b"\xff"])
def test_a_line_that_is_no_pair_is_named(line, tmp_path):
    write_pairs(tmp_path, [PAIR])
    with (tmp_path / "twins.jsonl").open("ab") as file:
        file.write(line + b"\n")
    with pytest.raises(DataError, match=r"twins\.jsonl:2: not a pair of twins"):
        read_pairs(tmp_path)


def test_both_questions_of_a_pair_name_it(tmp_path):
    path = tmp_path / "qa_set_twins.csv"
    written = [
        Question("a", "Was it open?", (1,), ("yes",), "open_state", pair="p/1", fact="p/fridge"),
        Question("b", "Was it open?", (1,), ("no",), "open_state", pair="p/1", fact="p/fridge"),
    ]
    write_questions(path, written)
    assert [(one.pair, one.fact) for one in read_questions(path)] == [("p/1", "p/fridge")] * 2


def test_other_files_have_no_such_columns():
    header = encode_questions([Question("a", "Was it open?", (1,), ("yes",))]).splitlines()[0]
    assert header == b"traj_id,question,gt_img_idx,answer,question_type,absence"


def test_the_pairs_are_in_the_sets_fingerprint(tmp_path):
    root = write_twin_set(tmp_path / "set")
    before = NiehSet(root).fingerprint
    pairs = read_pairs(root)
    write_pairs(root, [msgspec.structs.replace(pairs[0], base="another"), *pairs[1:]])
    assert NiehSet(root).fingerprint != before
    write_pairs(root, pairs)
    assert NiehSet(root).fingerprint == before
