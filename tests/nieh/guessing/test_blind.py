"""What `blind` says to the questions of a set."""

import random
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from statistics import fmean
from threading import Barrier, BrokenBarrierError

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.nieh.guessing import blind
from infthor_eval.nieh.guessing.blind import (
    find_blind,
    find_floor,
    questions_by_file,
    sample_on_clues,
    visible_knowledge,
)
from infthor_eval.nieh.guessing.guessers import GUESSERS, Knowledge, blind_guesser
from infthor_eval.storage.folders import user_cache

from ...helpers.questions import make_question, make_samples_on_clues

PRESENCE, OPEN = "Is Mug on the Bed?", "Was Box open?"


@pytest.fixture
def make_set(tmp_path):
    def make(**files):
        for name, questions in files.items():
            write_questions(tmp_path / f"qa_set_{name}.csv", questions)
        return NiehSet(tmp_path)

    return make


def constant(text, answers, clues=(1,)):
    return [make_question(f"t{i}", text, answer, clues) for i, answer in enumerate(answers)]


def test_on_the_clue_frames_their_number_is_told_and_elsewhere_the_words_alone():
    assert visible_knowledge("clues") == Knowledge.WORDS | Knowledge.NUMBER
    assert {visible_knowledge(name) for name in ("trajectory", "haystack", "imported")} == {
        Knowledge.WORDS
    }


def test_a_form_has_the_score_of_its_best_guesser(make_set):
    # Held out, the majority of four yes and a no is always yes; "no" is right for a single other
    # question alone.
    data = make_set(
        test=[*constant(PRESENCE, ("yes",) * 4 + ("no",)), *constant(OPEN, ("yes", "yes"))]
    )
    by_id = find_floor(data, Knowledge.WORDS)
    by_question = [by_id[question.id] for question in data.questions]
    assert [guess.form for guess in by_question] == ["Is {} in/on {}?"] * 5 + ["Was {} open?"] * 2
    assert [guess.scores["strict"] for guess in by_question] == [1, 1, 1, 1, 0, 1, 1]
    assert [guess.form_scores["strict"] for guess in by_question] == [pytest.approx(0.8)] * 5 + [
        1
    ] * 2
    assert find_floor(data, Knowledge.WORDS) is by_id


def test_guesses_are_learned_once_for_the_same_questions(make_set, monkeypatch):
    questions = [*constant(PRESENCE, ("yes",) * 4 + ("no",)), *constant(OPEN, ("yes", "yes"))]
    first = find_floor(make_set(test=questions), Knowledge.WORDS)
    with monkeypatch.context() as patch:
        patch.setattr(blind, "blind_guesser", None)  # nobody left to learn from
        assert find_floor(make_set(test=questions), Knowledge.WORDS) == first
    others = make_set(test=questions[:-1])
    assert len(find_floor(others, Knowledge.WORDS)) == len(first) - 1
    for path in user_cache("blind").iterdir():
        path.write_text("{")
    assert find_floor(make_set(test=questions), Knowledge.WORDS) == first


def test_a_file_is_guessed_from_itself_alone(make_set):
    data = make_set(
        a=constant(PRESENCE, ("yes",) * 3, (1,)), b=constant(PRESENCE, ("no",) * 3, (2,))
    )
    guesses = find_floor(data, Knowledge.WORDS)
    assert {guess.scores["strict"] for guess in guesses.values()} == {1.0}
    assert {name: len(questions) for name, questions in questions_by_file(data).items()} == {
        "qa_set_a": 3,
        "qa_set_b": 3,
    }


def test_what_a_guesser_may_not_know_does_not_help(make_set):
    key = [(f"t{i}", ("yes", "no")[j], ((1,), (1, 2))[j]) for i in range(6) for j in range(2)]
    data = make_set(
        test=[make_question(traj, PRESENCE, answer, clues) for traj, answer, clues in key]
    )
    with_clues, without_clues = (
        find_floor(data, knowledge) for knowledge in map(visible_knowledge, ("clues", "trajectory"))
    )
    assert {guess.form_scores["strict"] for guess in with_clues.values()} == {1.0}
    assert {guess.form_scores["strict"] for guess in without_clues.values()} == {0.5}


def words_tell(n):
    """On each trajectory, of things that are always in a place, and of those that never are."""
    things = (("Mug", "yes"), ("Box", "no"), ("Pan", "yes"), ("Pen", "no"))
    return [
        make_question(f"t{i}", f"Is {thing} on the Bed?", answer)
        for i in range(n)
        for thing, answer in things
    ]


@pytest.mark.parametrize("n_yes", [60, 30])
def test_where_nothing_tells_no_constant_is_far_above(n_yes):
    """Forty trajectories of three questions in six wordings. Balanced answers are the trap: what is
    the commoner on the others is the rarer on the own."""
    right = []
    for seed in range(4):
        draw = random.Random(seed)
        answers = ["yes"] * n_yes + ["no"] * (120 - n_yes)
        draw.shuffle(answers)
        questions = [
            make_question(f"t{i // 3}", f"Is {draw.choice('ABCDEF')} on the Bed?", answer, (i,))
            for i, answer in enumerate(answers)
        ]
        guesses = blind_guesser(Knowledge.WORDS).guess(make_samples_on_clues(*questions))
        right += [guess == answer for guess, answer in zip(guesses, answers, strict=True)]
    assert fmean(right) >= max(n_yes, 120 - n_yes) / 120 - 0.02


def test_blind_is_the_guesser_that_is_right_on_other_trajectories():
    for n in (3, 40):
        questions = words_tell(n)
        guesses = blind_guesser(Knowledge.WORDS).guess(make_samples_on_clues(*questions))
        assert guesses == [question.answers[0] for question in questions]


def test_a_form_leaves_the_guesser_of_all_forms_where_another_is_better_by_a_standard_error():
    odd = [make_question(f"t{i}", f"Where is Cup{i} now?", "Sink") for i in range(12)]
    questions = [*words_tell(12), *odd]
    by_words, by_constant = (
        next(it for it in GUESSERS if it.name == name).guess(make_samples_on_clues(*questions))
        for name in ("words", "one answer a form")
    )
    assert by_constant[48:] == ["Sink"] * 12
    guesses = blind_guesser(Knowledge.WORDS).guess(make_samples_on_clues(*questions))
    assert (
        guesses
        == [question.answers[0] for question in questions]
        == [*by_words[:48], *guesses[48:]]
    )


def test_of_a_set_of_one_trajectory_there_is_no_floor(make_set):
    data = make_set(test=[make_question("t", OPEN, "yes", (i,)) for i in range(4)])
    assert {it.reply for it in find_blind(data, Knowledge.WORDS).values()} == {"yes"}
    assert find_floor(data, Knowledge.WORDS) == {}


def test_a_question_on_its_clue_frames_has_them_in_order():
    assert sample_on_clues(make_question("t", PRESENCE, "yes", (5, 2))).frames == (2, 5)


def test_questions_that_are_asked_at_once_wait_for_the_one_that_learns(make_set, monkeypatch):
    data, started, n_learned = make_set(test=constant(OPEN, ("yes", "no"))), Barrier(2), []

    def learn(*_):
        n_learned.append(1)
        with suppress(BrokenBarrierError):
            started.wait(0.2)  # a second one that learned too would be here meanwhile
        return {}

    monkeypatch.setattr(blind, "_learn", learn)
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda _: find_floor(data, Knowledge.WORDS), range(2)))
    assert len(n_learned) == 1
