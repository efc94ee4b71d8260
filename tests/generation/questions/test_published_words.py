"""Questions in the published words: by hand, as the same questions as in ours, and against the
published files."""

import csv
import random
import re
from pathlib import Path

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.formats.question_forms import type_of
from infthor_eval.formats.step_log import read_steps
from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.generate import (
    candidates_of,
    further_candidates_of,
    generate_questions,
)
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.questions.published_words import in_published_words
from infthor_eval.household.wording import noun, object_type
from infthor_sim.object_types import OBJECT_TYPES

from ...helpers.bundled import BUNDLED

PUBLISHED = Path(__file__).parents[3] / "../shared/data/published_sets"
# One published question of each form and its answer, and our form and names. Our answers are
# theirs in lower case.
WORDS = [
    ("Is there any Window in this room?", "Yes", "Is there any {} in this room?", ("window",)),
    ("Have you seen an Apple?", "Yes", "Have you seen {}?", ("an apple",)),
    ("Have you seen a TVStand?", "Yes", "Have you seen {}?", ("a TV stand",)),
    ("Was Box open?", "Yes", "Was {} open?", ("the box",)),
    (
        "Where was CellPhone before you put it to SideTable?",
        "CoffeeTable",
        "Where was {} before you put it {}?",
        ("the cell phone", "on the side table"),
    ),
    (
        "Where did you move the RemoteControl from the TVStand?",
        "Sofa",
        "Where did you move {} from {}?",
        ("the remote control", "the TV stand"),
    ),
    ("Where is CD now?", "SideTable", "Where is {} now?", ("the CD",)),
    ("What did you slice?", "Apple", "What did you slice?", ()),
    (
        "What objects were in DiningTable when you slice Potato?",
        "Potato",
        "What objects were {} when you sliced {}?",
        ("on the dining table", "the potato"),
    ),
    ("What objects were in Fridge?", "Egg", "What objects were {}?", ("in the fridge",)),
    (
        "What object did you put on the Drawer?",
        "KeyChain",
        "What object did you put {}?",
        ("in the drawer",),
    ),
    ("What objects are on the SideTable?", "Pen", "What objects are {}?", ("on the side table",)),
    ("How many objects were on the Fridge?", 2, "How many objects were {}?", ("in the fridge",)),
    ("Is KeyChain in the Drawer?", "No", "Is {} {}?", ("the key chain", "in the drawer")),
    (
        "Is RemoteControl on the DiningTable?",
        "Yes",
        "Is {} {}?",
        ("the remote control", "on the dining table"),
    ),
    (
        "How many times did you move Newspaper?",
        2,
        "How many times did you move {}?",
        ("the newspaper",),
    ),
]


@pytest.mark.parametrize(
    ("text", "answer", "form", "names"), WORDS, ids=[words[0] for words in WORDS]
)
def test_each_form_has_the_published_words(text, answer, form, names):
    subjects = (str(answer), "Mug")
    candidate = Candidate(type_of(text), form, names, (3, 7), (str(answer).lower(),), subjects)
    question = in_published_words(candidate, "a")
    assert (question.text, question.answers, question.clues) == (text, (answer,), (3, 7))
    assert type_of(text) == type_of(candidate.text) != ""


@pytest.mark.parametrize("name", sorted(OBJECT_TYPES))
def test_a_type_is_recovered_from_its_words(name):
    assert object_type(noun(name)) == name


def histories():
    for log in sorted((BUNDLED / "metadata").glob("*/metadata.json"))[:3]:
        yield TrajectoryHistory(log.parent.name, read_steps(log.parent))


def test_all_candidates_of_table_3_are_the_same_questions_in_both_words():
    n = 0
    for history in histories():
        for candidate in candidates_of(history, frozenset({"Apple", "Statue"}), random.Random(0)):
            ours, published = candidate.question("a"), in_published_words(candidate, "a")
            assert (published.clues, published.absence) == (ours.clues, ours.absence)
            types = {published.question_type, type_of(ours.text), type_of(published.text)}
            assert types == {ours.question_type}
            assert [str(answer).lower() for answer in published.answers] == list(ours.answers)
            n += 1
    assert n > 80


def test_further_forms_have_no_published_words():
    history = next(histories())
    with pytest.raises(ValueError, match="has no published words"):
        in_published_words(further_candidates_of(history, random.Random(0))[0], "a")
    with pytest.raises(
        UsageError, match="--further adds forms that have no published words; leave it out"
    ):
        generate_questions(BUNDLED, further=True, published_words=True)


@pytest.mark.skipif(
    not PUBLISHED.is_dir(), reason="the published question files are not at ../shared/data"
)
def test_every_published_question_is_in_words_that_we_write():
    patterns = {
        re.sub(r"(?<![A-Za-z])[A-Z][A-Za-z]*(?= |\?)", r"[A-Z][A-Za-z]*", text[1:]): text[0]
        for text, *_ in WORDS
    }
    patterns = [re.compile(first + rest.replace("?", r"\?")) for rest, first in patterns.items()]
    rows = [
        row
        for file in PUBLISHED.glob("qa_set*.csv")
        for row in csv.DictReader(file.open(encoding="utf-8"))
    ]
    assert len(rows) == 1303
    asked = [row["question"] for row in rows]
    unlike = [text for text in asked if not any(pattern.fullmatch(text) for pattern in patterns)]
    assert unlike == ["Is Knife in the agent?"]
    answers = re.compile(r"\['(Yes|No)'\]|\[\d+\]|\[('[A-Z]\w+'(, )?)+\]")
    assert all(answers.fullmatch(row["answer"]) for row in rows)
