"""The learner, on sets in which one thing alone gives the answer away."""

from dataclasses import replace

import pytest

from infthor_eval.nieh.guessing.clue_facts import ClueFacts
from infthor_eval.nieh.guessing.learner import guess_by_learning

from ...helpers.questions import guess_with, make_question, make_samples_on_clues

TEXTS = ("Is Mug on the Bed?", "Is Box on the Bed?")


def right(samples, **knowledge):
    guesses = guess_with(guess_by_learning, samples, **knowledge)
    return sum(
        guess == sample.question.answers[0] for guess, sample in zip(guesses, samples, strict=True)
    )


def of_both(clues, answers=("yes", "no")):
    """Two questions in the same words on each of six trajectories, which differ in their clues and
    answers."""
    each = zip(clues, answers, strict=True)
    pairs = list(each)
    return make_samples_on_clues(
        *(
            make_question(f"t{i}", TEXTS[0], answer, of_one)
            for i in range(6)
            for of_one, answer in pairs
        )
    )


def test_words_that_give_the_answer_away_are_learned():
    questions = [make_question(f"t{i}", TEXTS[i % 2], ("yes", "no")[i % 2]) for i in range(12)]
    assert right(make_samples_on_clues(*questions), number=False, place=False) == 12


@pytest.mark.parametrize(
    ("clues", "knowledge"),
    [
        (((1,), (1, 2)), {"number": True, "place": False}),
        (((10,), (510,)), {"number": False, "place": True}),
        (((10, 20), (10, 90)), {"number": False, "place": True}),  # their span
    ],
)
def test_number_and_place_are_learned_by_those_that_know_them_alone(clues, knowledge):
    samples = of_both(clues)
    assert right(samples, **knowledge) == 12
    assert right(samples, number=False, place=False) == 6


@pytest.mark.parametrize("field", ["hand_full", "n_in_view", "n_at_edge", "progress"])
def test_facts_of_the_clues_are_learned_by_who_knows_them_alone(field):
    samples = of_both(((1,), (1,)))
    facts = {}
    for sample in samples:
        is_yes = sample.question.answers == ("yes",)
        fact = ClueFacts(progress=0.0, hand_full=False, n_in_view=0, n_at_edge=0)
        facts[sample.question.id] = (replace(fact, **{field: int(is_yes)}),)
    knowledge = {"number": False, "place": False}
    assert right(samples, **knowledge, facts=facts) == 12
    assert right(samples, **knowledge) == 6


def test_of_a_scene_that_is_held_out_nothing_is_learned():
    # Each scene has one answer, and two trajectories: who knows the other one is right.
    questions = [make_question(f"t{i}", f"{i // 2}?", ("yes", "no")[i // 2 % 2]) for i in range(8)]
    samples = make_samples_on_clues(*questions)
    scenes = {f"t{i}": f"scene-{i // 2}" for i in range(8)}
    for held_out, expected in (({}, 8), (scenes, 0)):
        guesses = guess_with(guess_by_learning, samples, held_out, number=False, place=False)
        assert (
            sum(guess == item.answers[0] for guess, item in zip(guesses, questions, strict=True))
            == expected
        )


def test_without_another_answer_there_is_nothing_to_fit():
    same = make_samples_on_clues(*(make_question(f"t{i}", TEXTS[0], "yes") for i in range(3)))
    assert guess_with(guess_by_learning, same, number=True, place=True) == ["yes"] * 3


def test_on_one_trajectory_each_question_is_guessed_from_the_others():
    samples = make_samples_on_clues(
        *(make_question("t", TEXTS[i % 2], ("yes", "no")[i % 2], (i,)) for i in range(12))
    )
    assert right(samples, number=False, place=False) == 12
