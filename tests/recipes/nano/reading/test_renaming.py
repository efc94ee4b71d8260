import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.household.wording import canonical_type
from recipes.nano.reading.renaming import Renaming, Vocabulary

VOCABULARY = Vocabulary(
    ["Apple", "Mug", "ButterKnife", "Egg", "Boots", "AppleSliced"],
    ["Fridge", "CounterTop", "SinkBasin", "Shelf"],
    ["Window"],
)
RENAMING = Renaming({"Apple": "Mug", "Mug": "Apple", "Fridge": "CounterTop", "Egg": "Boots"})


@pytest.mark.parametrize(
    ("text", "renamed"),
    [
        ("Where is the apple now?", "Where is the mug now?"),
        ("What objects are in the fridge?", "What objects are on the counter top?"),
        ("Have you seen a mug?", "Have you seen an apple?"),
        ("Have you seen an egg?", "Have you seen boots?"),
        ("How many apples did you see?", "How many mugs did you see?"),
        ("Is the butter knife in the sink?", "Is the butter knife in the sink?"),
        ("Is there any apple in this room?", "Is there any mug in this room?"),
    ],
)
def test_questions_are_about_the_new_things(text, renamed):
    assert VOCABULARY.rename(text, RENAMING) == renamed


def test_answers_are_the_new_things():
    answers = ["apple", "yes", "3", "fridge", "something else"]
    renamed = [VOCABULARY.rename_answer(answer, RENAMING) for answer in answers]
    assert renamed == ["mug", "yes", "3", "countertop", "something else"]


def test_a_renamed_question_can_be_named_back():
    back = Renaming({new: old for old, new in RENAMING.new.items()} | {"CounterTop": "Fridge"})
    text = "Where did you move the apple from the fridge?"
    assert VOCABULARY.rename(VOCABULARY.rename(text, RENAMING), back) == text


@given(st.integers(0, 9999))
def test_random_renamings_are_one_to_one_within_a_kind(seed):
    renaming = VOCABULARY.draw(random.Random(seed))
    for group in (VOCABULARY.loose, VOCABULARY.fixtures):
        assert sorted(map(renaming, group)) == list(group)
    assert renaming("Window") == "Window"


def test_slices_and_parts_are_no_types_of_their_own():
    assert "AppleSliced" not in VOCABULARY.loose
    assert VOCABULARY.fixtures == tuple(
        sorted(map(canonical_type, ["Fridge", "CounterTop", "Sink", "Shelf"]))
    )


def test_phrases_are_what_is_said_around_the_types():
    text = "Where did you move the apple from the fridge?"
    assert VOCABULARY.phrases(text) == [" Where did you move the", " from the", " ?"]
    assert VOCABULARY.form(text) == "Where did you move the _ from the _?"
