"""Types of questions by their words, against files that name them and against the published
ones."""

import re
from collections import Counter
from itertools import product
from pathlib import Path

import pytest

from infthor_eval.formats.qa_csv import read_questions
from infthor_eval.formats.question_forms import FORMS, FURTHER_FORMS, find_form, type_of
from infthor_eval.storage.folders import packaged_folder

PUBLISHED = Path(__file__).parents[2] / "../shared/data/published_sets"


@pytest.mark.parametrize("form", (*FORMS, *FURTHER_FORMS), ids=lambda form: form.words)
def test_a_form_is_told_by_its_words_and_by_no_others(form):
    published, ours = ("Mug", "CoffeeTable"), ("the mug", "the coffee table")
    pairs = (published, ours, ("an alarm clock", "the bed"))
    for names, which in product(pairs, (0, -1)):
        text = form.words
        for either in re.findall(r"\w+(?:/\w+)+", text):
            text = text.replace(either, either.split("/")[which])
        for name in names:
            text = text.replace("{}", name, 1)
        assert find_form(text) is form
        assert find_form(f"Oh! {text}") is None


@pytest.mark.parametrize(
    "text", ["", "?", "Is there a mug?", "Where was the mug?", "How many mugs?", "What is in it?"]
)
def test_other_questions_have_no_type(text):
    assert type_of(text) == ""


def test_the_words_of_the_bundled_questions_give_the_types_that_their_file_names():
    questions = read_questions(packaged_folder("sets/nieh_mini") / "qa_set_nieh_mini.csv")
    assert len([item for item in questions if item.question_type.endswith("_further")]) > 30
    assert all(type_of(item.text) == item.question_type for item in questions)


@pytest.mark.skipif(
    not PUBLISHED.is_dir(), reason="the published question files are not at ../shared/data"
)
def test_every_published_question_has_a_type():
    single, multi = (read_questions(path) for path in sorted(PUBLISHED.glob("qa_set*.csv")))
    # Counted by hand from the files: single clue, several clues.
    assert Counter(type_of(item.text) for item in single) == {
        "object_presence": 166, "open_state": 28, "location_tracing": 179, "slicing": 6,
        "container_content": 2,
        "put_action": 54, "final_state": 394,
    }  # fmt: skip
    assert Counter(type_of(item.text) for item in multi) == {
        "location_tracing": 222, "slicing": 3, "container_content": 2, "final_state": 213,
        "movement_counting": 34,
    }  # fmt: skip
