"""Synthetic questions on frames made by hand, where a person can tell the answers."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_eval.training.nano.seen_objects import SeenFrame, SeenObject
from infthor_eval.training.nano.synthetic_questions import SyntheticQuestions

BOX = (0, 0, 9, 9)


def _frame(*objects):
    return SeenFrame(None, objects)


def _seen(name, parent=None, *, is_shown=True, **state):
    return SeenObject(name, BOX, is_shown, parent, **state)


MUG_ON_TABLE = _frame(
    _seen("Mug", "DiningTable"), _seen("DiningTable"), _seen("Fridge", is_open=False)
)
MUG_IN_HAND = _frame(_seen("Mug", is_held=True), _seen("Fridge", is_open=True))
MUG_IN_SINK = _frame(_seen("Mug", "SinkBasin"), _seen("SinkBasin"), _seen("Egg", "Fridge"))
EGG_IN_HAND = _frame(_seen("Egg", is_held=True), _seen("DiningTable"))
FAR = _frame(_seen("Mug", "DiningTable", is_shown=False), _seen("DiningTable"))
TWO_MUGS = _frame(_seen("Mug", "DiningTable"), _seen("Mug", "Shelf"), _seen("DiningTable"))
ALL = (MUG_ON_TABLE, MUG_IN_HAND, MUG_IN_SINK, EGG_IN_HAND, FAR, TWO_MUGS)
QUESTIONS = SyntheticQuestions(ALL)


def _asked(*frames):
    """Return the answers by text of all questions that can be drawn."""
    answers = {}
    for seed in range(60):
        for text, answer in QUESTIONS.ask(frames, 20, random.Random(seed)):
            assert answers.setdefault(text, answer) == answer
    return answers


@pytest.mark.parametrize(
    ("frames", "text", "answer"),
    [
        ([MUG_ON_TABLE], "Have you seen a mug?", "yes"),
        ([MUG_ON_TABLE], "Is there any egg in this room?", "no"),
        ([MUG_ON_TABLE], "Where is the mug now?", "diningtable"),
        ([MUG_ON_TABLE], "Is the mug on the dining table?", "yes"),
        ([MUG_ON_TABLE], "Is the fridge open now?", "no"),
        ([MUG_ON_TABLE], "What objects were on the dining table?", "mug"),
        ([MUG_ON_TABLE, MUG_IN_HAND], "Was the fridge open?", "yes"),
        ([MUG_ON_TABLE, MUG_IN_HAND, MUG_IN_SINK], "Where did you move the mug to?", "sink"),
        ([MUG_IN_SINK, EGG_IN_HAND], "Is the mug in the sink?", "yes"),
        ([MUG_IN_HAND, EGG_IN_HAND], "What did you pick up first?", "mug"),
        ([EGG_IN_HAND, MUG_IN_HAND], "What did you pick up first?", "egg"),
        (
            [MUG_IN_HAND, MUG_IN_SINK, EGG_IN_HAND, MUG_IN_HAND],
            "How many different objects did you pick up?",
            "2",
        ),
    ],
)
def test_answers_are_what_the_frames_show(frames, text, answer):
    assert _asked(*frames)[text] == answer


@pytest.mark.parametrize(
    ("frames", "text"),
    [
        ([FAR], "Have you seen a mug?"),  # there, but too far away to say either
        ([TWO_MUGS], "Where is the mug now?"),  # which one?
        ([MUG_ON_TABLE, MUG_IN_HAND], "Where is the mug now?"),  # in no receptacle
        ([FAR], "What did you pick up first?"),
    ],
)
def test_what_the_frames_do_not_settle_is_not_asked(frames, text):
    assert text not in _asked(*frames)


@settings(deadline=None, max_examples=50)
@given(st.lists(st.sampled_from(ALL), min_size=1, max_size=6), st.integers(1, 12), st.integers())
def test_questions_are_distinct_and_never_more_than_asked_for(frames, n, seed):
    drawn = QUESTIONS.ask(frames, n, random.Random(seed))
    assert len(drawn) <= n
    assert len({text for text, _ in drawn}) == len(drawn)
