"""The guesser by chains of words, by hand."""

import tracemalloc

import pytest

from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.guessing.chains import (
    chains_of_words,
    chains_of_words_and_count,
    chains_of_words_and_place,
    guess_by_chains,
    words_of,
)
from infthor_eval.nieh.guessing.folds import held_out
from infthor_eval.nieh.guessing.guessers import GUESSERS

from ...helpers.questions import guess_with, make_question, make_samples_on_clues

QUESTION = make_question("t", "Is Mug on-the Bed?", "yes", (250, 310))
LEADING = [("leading", *words) for words in (["is"], ["is", "mug"], ["is", "mug", "on"])]


def test_words_are_in_lower_case_without_marks():
    assert words_of(QUESTION) == ["is", "mug", "on", "the", "bed"]


def test_chains_go_from_the_general_to_the_particular():
    (sample,) = make_samples_on_clues(QUESTION)
    leading, *later = chains_of_words(sample)
    assert leading[:3] == LEADING
    assert leading[3:] == [(*LEADING[2], "the"), (*LEADING[2], "the", "bed")]
    assert later == [[("word", word), ("word", "is", "mug", word)] for word in ("bed", "on", "the")]


def test_number_and_place_follow_the_stem():
    (sample,) = make_samples_on_clues(QUESTION)
    stem = ("stem", "is", "mug", "on")
    assert chains_of_words_and_count(sample) == [
        *chains_of_words(sample),
        [stem, ("count", *stem[1:], 2)],
    ]
    # The last clue is in the fourth hundred; they span 60 frames, a number of six bits.
    place = [[stem, ("place", *stem[1:], 3)], [stem, ("span", *stem[1:], 6)]]
    assert chains_of_words_and_place(sample) == [*chains_of_words(sample), *place]


def test_a_question_is_left_out_with_its_trajectory_or_alone_if_there_is_one():
    several = make_samples_on_clues(
        make_question("t", "A?", "x"), make_question("t", "B?", "x"), make_question("u", "C?", "x")
    )
    assert list(map(held_out(several), several)) == ["t", "t", "u"]
    alone = several[:2]
    assert list(map(held_out(alone), alone)) == [sample.question.id for sample in alone]


def chain_of(*contexts):
    """Chains that are the same for every sample: one of these contexts."""
    return lambda sample: [[context(sample) for context in contexts]]


@pytest.mark.parametrize(("n_y", "guess"), [(2, "x"), (3, "y")])
def test_a_context_counts_less_the_more_different_answers_it_has(n_y, guess):
    """Witten and Bell's interpolation by hand.

    Of 20 answers 18 are x. After the word "a" there are 1 x and 2 y, two different answers: x has
    (1 + 2 * 18 / 20) / (3 + 2) = 0.56. With a third y it has (1 + 2 * 18 / 21) / (4 + 2) = 0.45.
    """
    key = [("a", "x"), *[("a", "y")] * n_y, *[("c", "x")] * 17]
    samples = make_samples_on_clues(
        *(make_question(f"t{number}", text, answer) for number, (text, answer) in enumerate(key)),
        *(make_question("new", text, "?") for text in "ae"),
    )
    folds = [0] * len(key) + [1, 1]
    fit = guess_by_chains(samples, folds, chain_of(lambda sample: sample.question.text))
    assert fit(frozenset({1})) == {len(key): guess, len(key) + 1: "x"}


def test_own_answers_are_taken_away_before_counting():
    """On trajectory t the answer after "a" is always x; the others give y after it, and x
    elsewhere."""
    key = [("t", "a", "x")] * 5 + [("u", "a", "y"), ("u", "b", "x"), ("v", "b", "x")]
    samples = [
        QuestionVariant(make_question(traj, text, answer, (number,)), (1,))
        for number, (traj, text, answer) in enumerate(key)
    ]
    chains = chain_of(lambda sample: sample.question.text)
    guesses = guess_with(guess_by_chains, samples, chains=chains)
    # After "a": (0 + 1 * 2/3) / 2 = 1/3 for x and (1 + 1/3) / 2 = 2/3 for y.
    assert (guesses[0], guesses[5]) == ("y", "x")


def test_of_equally_likely_answers_the_first_in_the_alphabet_is_guessed():
    samples = make_samples_on_clues(
        *(
            make_question(f"t{i}", "Why?", answer)
            for i, answer in enumerate(("pear", "fig", "pear", "fig", "?"))
        )
    )
    fit = guess_by_chains(samples, [0, 0, 0, 0, 1], chains_of_words)
    assert fit(frozenset({1})) == {4: "fig"}


def test_a_long_question_takes_memory_by_its_length():
    """Chains of all its leading words, and forms before each word, would take gigabytes."""
    (short, long) = (
        make_samples_on_clues(
            make_question("t", "w" * 9 * n + " " + " ".join(f"w{i}" for i in range(9 * n)), "x"),
            make_question("u", "Why?", "y"),
        )
        for n in (100, 1000)
    )
    assert len(short[0].question.text) > 5000
    peaks = []
    for samples in (short, long):
        tracemalloc.start()
        for name in ("words", "learner: words"):
            guesser = next(it for it in GUESSERS if it.name == name)
            assert guesser.guess(samples) == ["y", "x"]
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 26 * peaks[0]
