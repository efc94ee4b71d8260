"""What `blind` says to the questions of a set."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from threading import Barrier, BrokenBarrierError

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.nieh.guessing import blind
from infthor_eval.nieh.guessing.blind import (
    find_floor,
    questions_by_file,
    sample_on_clues,
    visible_knowledge,
)
from infthor_eval.nieh.guessing.guessers import GUESSERS, Knowledge
from infthor_eval.nieh.results.above_blind import above_blind
from infthor_eval.storage.folders import user_cache

from ...helpers.nieh_runs import make_record
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


def test_no_guesser_is_above_blind_and_the_best_is_there(make_set):
    answers = ("yes", "yes", "no", "yes", "no", "no", "yes", "no", "yes")
    questions = [
        make_question(
            f"t{i % 5}",
            f"Is {('Mug', 'Box', 'Pan')[i % 3]} on the Bed?",
            answer,
            (i, i + 9)[: 1 + i % 2],
        )
        for i, answer in enumerate(answers)
    ]
    data = make_set(test=questions)
    guesses = find_floor(data, ~Knowledge.FILE)
    scores = []
    for guesser in GUESSERS:
        replies = zip(questions, guesser.guess(make_samples_on_clues(*questions)), strict=True)
        records = [
            make_record(i, reply, question.answers, blind=guesses[question.id])
            for i, (question, reply) in enumerate(replies)
        ]
        scores.append(above_blind(records, "strict").mean)
    assert max(scores) == pytest.approx(0)


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
