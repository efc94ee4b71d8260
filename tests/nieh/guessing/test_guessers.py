"""Guessers: what they learn from, and what they get on the published files."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.guessing.audit import audit, groups, sentences
from infthor_eval.nieh.guessing.forms import form_of
from infthor_eval.nieh.guessing.guessers import GUESSERS, Knowledge
from infthor_eval.nieh.guessing.guesses import find_guesses, sample_on_clues, visible_knowledge

PUBLISHED = Path(__file__).parents[4] / "shared" / "data" / "published_sets"
NAMES = [guesser.name for guesser in GUESSERS]


def question(traj_id, text, answer, clues=(1,)):
    return Question(traj_id, text, clues, (answer,))


def guesses(name, questions):
    return GUESSERS[NAMES.index(name)].guess([sample_on_clues(item) for item in questions])


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=5)
@given(own=st.integers(0, 3), objects=st.lists(st.sampled_from(["mug", "book", "cup"]), min_size=8, max_size=12))
def test_nothing_is_learned_from_the_own_trajectory(name, own, objects):
    questions = [
        question(f"t{n % 4}", f"Where is the {item} now?", "own" if n % 4 == own else item, (n, n + 2))
        for n, item in enumerate(objects)
    ]
    answers = guesses(name, questions)
    assert all(guess != "own" for item, guess in zip(questions, answers, strict=True) if item.traj_id == f"t{own}")


@pytest.mark.parametrize("name", NAMES)
def test_on_one_trajectory_a_question_is_guessed_from_the_others(name):
    questions = [question("t", f"Is there a {item}?", "yes") for item in ("mug", "book", "cup", "pan")]
    assert guesses(name, [*questions, question("t", "Is there a box?", "no")]) == ["yes"] * 5
    assert guesses(name, questions[:1]) == [""]


def test_a_constant_is_that_of_the_file_or_of_the_form():
    questions = [question(f"t{n}", "Is there any mug in this room?", "yes") for n in range(4)]
    questions += [question(f"t{n}", "Where is the mug now?", "Shelf") for n in range(2)]
    assert guesses("one answer a file", questions) == ["yes"] * 6
    assert guesses("one answer a form", questions) == ["yes"] * 4 + ["Shelf"] * 2


def test_the_number_of_frames_is_known_to_those_that_are_said_to_know_it():
    """The answer is the number of clue frames, and nothing else tells it."""
    questions = [question(f"t{n}", "How many times did you move the mug?", n % 3 + 1, tuple(range(n % 3 + 1)))
                 for n in range(18)]  # fmt: skip
    for guesser in GUESSERS:
        right = sum(
            guess == str(item.answers[0])
            for item, guess in zip(questions, guesses(guesser.name, questions), strict=True)
        )
        if guesser.knows in Knowledge.WORDS:
            assert right < 12
        elif Knowledge.PLACE not in guesser.knows:
            assert right == 18


def test_a_run_is_measured_by_what_its_context_tells(make_nieh_set):
    questions = [question(f"t{n}", "How many times did you move the mug?", n % 3 + 1, tuple(range(n % 3 + 1)))
                 for n in range(12)]  # fmt: skip
    data = NiehSet(make_nieh_set(questions, size=8))
    of_context = {name: find_guesses(data, visible_knowledge(name)) for name in ("clues", "trajectory")}
    means = {name: {guess.form_scores["strict"] for guess in found.values()} for name, found in of_context.items()}
    assert means["clues"] == {1.0}
    assert max(means["trajectory"]) < 0.5


def test_a_form_is_that_of_table_3_else_the_type_else_the_first_words():
    assert form_of(question("t", "Is the mug on the table?", "yes")) == "Is {} in/on {}?"
    assert form_of(Question("t", "Which one?", (1,), ("a",), "put_action_further")) == "put_action_further"
    assert form_of(question("t", "Which one is it?", "a")) == "which one"


def test_sentences_say_what_is_striking(make_nieh_set):
    questions = [question(f"t{n % 5}", f"Have you seen a thing{n}?", "yes") for n in range(24)]
    said = list(sentences(audit(NiehSet(make_nieh_set(questions, size=8)))))
    assert said[0] == "All 24 yes/no questions of this set are yes."
    assert said[1] == "Have you seen {}? (24 questions): the answer is always yes."
    assert said[-1] == "all: 100.00 % can be had without a frame (one answer a file)."


def test_groups_have_entropy_and_share_of_yes(make_nieh_set):
    answers = ["yes", "yes", "yes", "no"]
    questions = [question(f"t{n}", f"Have you seen a thing{n}?", answer) for n, answer in enumerate(answers)]
    (group,) = groups(audit(NiehSet(make_nieh_set(questions, size=8))), "form")
    assert (group.share_yes, round(group.entropy, 4)) == (0.75, 0.8113)  # -3/4 log2 3/4 - 1/4 log2 1/4


@pytest.mark.skipif(not PUBLISHED.is_dir(), reason="the published question files are not at ../shared/data")
def test_the_published_files():
    audited = audit(NiehSet(PUBLISHED), "reference")
    means = {
        group.name: dict(zip(NAMES, (round(100 * mean, 2) for mean in group.means()), strict=True))
        for group in groups(audited, "file")
    }
    single, multi = means["qa_set_nieh_single_clue"], means["qa_set_nsieh_multi_clue"]
    assert (single["one answer a file"], multi["one answer a file"]) == (63.33, 44.94)
    assert (single["words (blind)"], multi["words (blind)"]) == (76.47, 67.33)
    learner = "learner: words, number of frames"
    assert single[learner] >= single["words (blind)"]
    assert multi[learner] >= multi["words (blind)"]
    said = list(sentences(audited))
    assert "All 525 yes/no questions of qa_set_nieh_single_clue are yes." in said
    assert "All 213 yes/no questions of qa_set_nsieh_multi_clue are no." in said
