"""The learner, on sets in which one thing alone gives the answer away."""

import pytest

from infthor_eval.nieh.guessing.learner import guess_by_learning

from ...helpers.questions import make_question, make_samples_on_clues

TEXTS = ("Is Mug on the Bed?", "Is Box on the Bed?")


def right(samples, **knowledge):
    guesses = guess_by_learning(samples, **knowledge)
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


def test_without_another_trajectory_or_answer_there_is_nothing_to_fit():
    (alone,) = make_samples_on_clues(make_question("t", TEXTS[0], "yes"))
    assert guess_by_learning([alone], number=True, place=True) == [""]
    same = make_samples_on_clues(*(make_question(f"t{i}", TEXTS[0], "yes") for i in range(3)))
    assert guess_by_learning(same, number=True, place=True) == ["yes"] * 3


def test_on_one_trajectory_each_question_is_guessed_from_the_others():
    samples = make_samples_on_clues(
        *(make_question("t", TEXTS[i % 2], ("yes", "no")[i % 2], (i,)) for i in range(12))
    )
    assert right(samples, number=False, place=False) == 12
