"""Synthetic questions on frames made by hand, where a person can tell the answers."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recipes.nano.seen_objects import SeenFrame, SeenObject
from recipes.nano.synthetic_questions import Kind, SyntheticQuestions

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
TWO_THINGS = _frame(
    _seen("Mug", "DiningTable"), _seen("Egg", "DiningTable"), _seen("DiningTable"), _seen("Sink")
)
ALL = (MUG_ON_TABLE, MUG_IN_HAND, MUG_IN_SINK, EGG_IN_HAND, FAR, TWO_MUGS, TWO_THINGS)
QUESTIONS = SyntheticQuestions(ALL)


def _asked(*frames):
    """Return the answers by text of all questions that can be drawn."""
    answers = {}
    shown = [objects for _, objects in frames]
    for seed in range(60):
        for text, answer in QUESTIONS.ask(shown, 20, random.Random(seed)):
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
        ([TWO_THINGS], "What objects are on the dining table?", "egg, mug"),
        (
            [TWO_THINGS],
            "Which other things that can be picked up were directly on the dining table when you "
            "picked up the mug from it?",
            "egg",
        ),
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


@pytest.mark.parametrize("frames", [[TWO_THINGS], [MUG_ON_TABLE, MUG_IN_SINK]])
def test_something_is_said_to_be_elsewhere_as_often_as_where_it_is(frames):
    shown = [objects for _, objects in frames]
    answers = [
        answer
        for seed in range(300)
        for text, answer in QUESTIONS.ask(shown, 20, random.Random(seed))
        if text.startswith("Is the ") and " open" not in text
    ]
    assert 0.4 < answers.count("yes") / len(answers) < 0.6


def test_fixtures_that_are_closed_are_asked_about_as_often_as_open_ones():
    closed, opened = _frame(_seen("Fridge", is_open=False)), _frame(_seen("Fridge", is_open=True))
    frames = [*[closed] * 9, opened]
    questions = SyntheticQuestions(frames)
    answers = [
        answer
        for seed in range(300)
        for frame in frames
        for text, answer in questions.ask([frame.objects], 20, random.Random(seed))
        if " open" in text
    ]
    assert 0.4 < answers.count("yes") / len(answers) < 0.6


@pytest.mark.parametrize(
    ("kind", "start"),
    [
        (Kind.OPENNESS, ("Is the fridge open", "Was the fridge open")),
        (Kind.WHETHER_THERE, ("Is the mug ", "Is the egg ")),
        (Kind.CONTENTS, ("What objects", "Which other things")),
    ],
)
def test_a_kind_that_is_sought_comes_first_or_nothing_is_asked(kind, start):
    shown = [objects for _, objects in (MUG_ON_TABLE, TWO_THINGS)]
    for seed in range(20):
        (first, *_) = QUESTIONS.ask(shown, 5, random.Random(seed), kind)
        assert first[0].startswith(start)
        assert QUESTIONS.ask([FAR.objects], 5, random.Random(seed), kind) == []


@settings(deadline=None, max_examples=50)
@given(st.lists(st.sampled_from(ALL), min_size=1, max_size=6), st.integers(1, 12), st.integers())
def test_questions_are_distinct_and_never_more_than_asked_for(frames, n, seed):
    drawn = QUESTIONS.ask([objects for _, objects in frames], n, random.Random(seed))
    assert len(drawn) <= n
    assert len({text for text, _ in drawn}) == len(drawn)
