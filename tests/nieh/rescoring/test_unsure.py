"""Which replies the rules are unsure of: pairs judged by hand."""

import pytest

from infthor_eval.nieh.rescoring.unsure import KnownAnswers

from ...helpers.nieh_runs import make_record

# The other questions of the run: containers for one type, things for another.
PLACES = [
    make_record(n, "?", (name,), question_type="where")
    for n, name in enumerate(("Sofa", "Desk", "CoffeeTable", "Bed"))
]
THINGS = [
    make_record(n, "?", (name,), question_type="what")
    for n, name in enumerate(("Box", "Mug", "Plate"), 10)
]
FAILED = make_record(20, None, ("TVStand",), question_type="where")
COUNTS = [
    make_record(30, "3", (3,), question_type="where"),
    make_record(31, "no", ("No",), question_type="where"),
]

UNSURE = [
    ("the small table", ("SideTable",)),
    ("Floor", ("SideTable",)),
    ("couch", ("SideTable",)),  # a synonym of Sofa, but so is "on table" of several places
    ("to the side table", ("SideTable",)),
    ("Sofa, SideTable", ("SideTable",)),  # the right one among others
    ("Sofa and the small table", ("SideTable",)),
    ("nothing", ("SideTable",)),
    ("Mug", ("SideTable",)),  # known, but of another type of question
    ("box, ring", ("Box", "KeyChain")),
    ("ring", ("Box", "KeyChain")),
    ("I saw it.\nthe small table", ("SideTable",)),
]
SURE = [
    ("SideTable", ("SideTable",)),  # right
    ("Sofa", ("SideTable",)),
    ("on the sofa", ("SideTable",)),
    ("Coffee table.", ("SideTable",)),
    ("To the Desk", ("SideTable",)),
    ("it is the sofa", ("SideTable",)),
    ("Sofa, Bed", ("SideTable",)),
    ("tv stand", ("SideTable",)),  # of a question on which the model failed
    ("a long story\nSofa", ("SideTable",)),
    ("", ("SideTable",)),
    ("  \n ", ("SideTable",)),
    ("yes", ("SideTable",)),
    ("No.", ("SideTable",)),
    ("2", ("SideTable",)),
    ("no, on the sofa", ("SideTable",)),
    ("box", ("Box", "KeyChain")),  # one of the two, and nothing else
    ("box, plate", ("Box", "KeyChain")),
    ("keys", ("Box", "KeyChain")),  # a synonym of one that is wanted
    ("the small table", ("yes",)),  # not open-ended
    ("several", (3,)),
    (None, ("SideTable",)),
]


def is_unsure(reply, answers):
    record = make_record(99, reply, answers, question_type="what" if len(answers) > 1 else "where")
    return KnownAnswers([*PLACES, *THINGS, FAILED, *COUNTS, record]).is_unsure(record)


@pytest.mark.parametrize(("reply", "answers"), UNSURE)
def test_neither_right_nor_plainly_wrong(reply, answers):
    assert is_unsure(reply, answers)


@pytest.mark.parametrize(("reply", "answers"), SURE)
def test_right_or_plainly_wrong(reply, answers):
    assert not is_unsure(reply, answers)


def test_what_is_known_is_what_the_run_asks():
    alone = make_record(99, "Sofa", ("SideTable",), question_type="where")
    assert KnownAnswers([alone]).is_unsure(alone)
