"""A part of a set in which guessing does not help."""

import itertools
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_eval.nieh.guessing import balancing
from infthor_eval.nieh.guessing.balancing import MARGIN, balance
from infthor_eval.nieh.guessing.guessers import GUESSERS

from ...helpers.questions import make_question, make_samples_on_clues

FORM = "Is {} in/on {}?"
ANSWERS = ("yes", "no")
OBJECTS = ("Mug", "Box", "Pan", "Pen")


def presence(traj, thing, answer, clues=(1,)):
    return make_question(f"t{traj}", f"Is {thing} on the Bed?", answer, clues)


def fair(n_trajectories=4, things=OBJECTS):
    """Each question has either answer on half of the trajectories, so from the others the wrong one
    is likelier."""
    return [
        presence(traj, thing, ANSWERS[(traj + place) % 2])
        for traj in range(n_trajectories)
        for place, thing in enumerate(things)
    ]


def best_above_chance(questions):
    """How far the best guesser is above one over the number of answers; of one form."""
    chance = 1 / len({question.answers for question in questions})
    shares = []
    for guesser in GUESSERS:
        guesses = zip(questions, guesser.guess(make_samples_on_clues(*questions)), strict=True)
        shares.append(
            sum(guess == question.answers[0] for question, guess in guesses) / len(questions)
        )
    return max(shares) - chance


LEAKS = {
    "words": lambda traj, side, thing: presence(traj, f"{thing}{side}", ANSWERS[side]),
    "number": lambda traj, side, thing: presence(
        traj, thing, ANSWERS[side], ((1, 9), (1, 5, 9))[side]
    ),
    "place": lambda traj, side, thing: presence(traj, thing, ANSWERS[side], ((1,), (901,))[side]),
}


@pytest.mark.parametrize("leak", LEAKS)
def test_of_a_set_with_a_leak_a_part_without_it_is_kept(leak):
    leaky = [
        LEAKS[leak](traj, side, thing)
        for traj in range(4)
        for side in range(2)
        for thing in ("Cup", "Egg")
    ]
    before = [*leaky, *fair(things=OBJECTS[:2])]
    assert best_above_chance(before) > MARGIN  # or there would be nothing to prune
    balanced = balance(before)
    kept = set(balanced.questions)
    assert kept
    assert best_above_chance(balanced.questions) <= MARGIN + 1e-9
    assert len(kept & set(leaky)) < len(leaky)
    assert list(balanced.questions) == [question for question in before if question in kept]
    assert balanced.kept == {FORM: (len(kept), len(before))}
    assert (balanced.chance, balanced.best_score <= 0.5 + MARGIN) == (0.5, True)


def test_a_fair_set_is_kept_whole():
    questions = fair()
    balanced = balance(questions)
    assert (list(balanced.questions), balanced.chance) == (questions, 0.5)
    assert balanced.kept == {FORM: (16, 16)}
    assert balanced.best in {guesser.name for guesser in GUESSERS}
    assert balanced.best_score <= 0.5


def test_where_there_is_nothing_to_balance_the_part_is_empty():
    one_answer = [presence(traj, "Mug", "yes") for traj in range(4)]
    for questions, kept in ((one_answer, {FORM: (0, 4)}), ([], {})):
        balanced = balance(questions)
        found = (balanced.questions, balanced.chance, balanced.best, balanced.best_score)
        assert found == ((), 0.0, "none", 0.0)
        assert balanced.kept == kept


def test_a_form_with_one_answer_goes_and_the_others_stay():
    always = [make_question(f"t{traj}", "Was Box open?", "yes") for traj in range(4)]
    balanced = balance([*always, *fair()])
    assert list(balanced.questions) == fair()
    assert balanced.kept == {FORM: (16, 16), "Was {} open?": (0, 4)}


def test_files_are_counted_apart_but_balanced_together():
    """All yes in one file and all no in the other is no leak of the part, which is one file."""
    questions = [replace(it, file="ab"[it.answers == ("no",)]) for it in fair()]
    balanced = balance(questions)
    assert balanced.kept == {f"a: {FORM}": (8, 8), f"b: {FORM}": (8, 8)}


@settings(max_examples=50)
@given(st.lists(st.integers(1, 9), min_size=1, max_size=4))
def test_the_commonest_answers_are_cut_so_that_most_is_kept(sizes):
    """Against all ways to keep some of the commonest answers, each up to some number of
    questions."""
    questions = [
        presence(0, f"{answer}{number}", f"answer {answer}")
        for answer, size in enumerate(sizes)
        for number in range(size)
    ]
    left = balancing._cut_answers(questions)
    ordered = sorted(sizes, reverse=True)
    ways = [
        total
        for n, most in itertools.product(range(2, len(sizes) + 1), range(1, max(sizes) + 1))
        if most <= (1 / n + MARGIN) * (total := sum(min(size, most) for size in ordered[:n]))
    ]
    assert len(left) == max(ways, default=0)
    counts = [
        sum(question.answers == (f"answer {answer}",) for question in left)
        for answer in range(len(sizes))
    ]
    kept = [count for count in counts if count]
    assert not kept or max(kept) <= (1 / len(kept) + MARGIN) * len(left)
