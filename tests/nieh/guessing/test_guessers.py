"""All guessers: none knows the answers on a question's own trajectory."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_eval.nieh.guessing.blind import visible_knowledge
from infthor_eval.nieh.guessing.guessers import GUESSERS, Knowledge, blind_guesser

from ...helpers.questions import make_question, make_samples_on_clues

UNIQUE = "an answer that nobody else gives"
_TEXTS = st.sampled_from(
    ("Is Mug on the Bed?", "Is Box on the Bed?", "Where is Mug now?", "Did you see it?")
)
_ROWS = st.tuples(
    st.integers(0, 3), _TEXTS, st.sampled_from(("yes", "no", "Bed")), st.integers(1, 3)
)
BLIND = blind_guesser(visible_knowledge("clues"))
_EACH = pytest.mark.parametrize("guesser", (*GUESSERS, BLIND), ids=lambda guesser: guesser.name)


def questions_of(rows):
    return [
        make_question(f"t{traj}", text, answer, tuple(range(number, number + n_clues)))
        for number, (traj, text, answer, n_clues) in enumerate(rows)
    ]


def answered(question):
    return replace(question, answers=(UNIQUE,))


@_EACH
@settings(max_examples=8)
@given(
    st.lists(_ROWS, min_size=2, max_size=10).filter(lambda rows: len({row[0] for row in rows}) > 1)
)
def test_answers_on_the_own_trajectory_change_no_guess_at_it(guesser, rows):
    before = questions_of(rows)
    own = before[0].traj_id
    after = [answered(question) if question.traj_id == own else question for question in before]
    guesses = zip(
        before,
        guesser.guess(make_samples_on_clues(*before)),
        guesser.guess(make_samples_on_clues(*after)),
        strict=True,
    )
    assert all(
        first == second != UNIQUE for question, first, second in guesses if question.traj_id == own
    )


@_EACH
@settings(max_examples=8)
@given(st.lists(_ROWS, min_size=1, max_size=8), st.integers(0, 7))
def test_on_one_trajectory_alone_a_question_is_left_out_itself(guesser, rows, place):
    questions = questions_of([(0, *row[1:]) for row in rows])
    place %= len(questions)
    questions[place] = answered(questions[place])
    others = {question.answers[0] for question in questions} - {UNIQUE}
    assert guesser.guess(make_samples_on_clues(*questions))[place] in {*others, ""}


@_EACH
def test_what_the_others_answer_is_guessed(guesser):
    samples = make_samples_on_clues(
        *(make_question(f"t{i}", "Is Mug on the Bed?", "yes" if i else "no") for i in range(5))
    )
    assert guesser.guess(samples) == ["yes"] * 5


def named(name):
    return next(guesser for guesser in GUESSERS if guesser.name == name)


def test_a_constant_is_the_commonest_answer_elsewhere_or_yes_if_that_is_about_as_common():
    # t0 sees 9 no and a yes elsewhere; the others 3 or 4 yes, and 6 no: no is commoner by less than
    # a standard error, the square root of their sum.
    key = [("t0", "yes")] * 3 + [("t1", "yes"), *[("t2", "no")] * 6]
    samples = make_samples_on_clues(
        *(make_question(traj, f"{traj} {i}?", answer) for i, (traj, answer) in enumerate(key))
    )
    assert named("one answer a file").guess(samples) == ["no"] * 3 + ["yes"] * 7


def test_the_constant_of_a_form_is_that_of_its_answers_and_of_all_if_it_is_new():
    key = [("Is Mug on the Bed?", "no"), ("Was Box open?", "yes")]
    samples = make_samples_on_clues(*(make_question(f"t{i}", *key[i % 2]) for i in range(6)))
    assert named("one answer a form").guess(samples) == ["no", "yes"] * 3
    new = make_samples_on_clues(make_question("t9", "Why?", "x"), make_question("t8", "How?", "y"))
    assert named("one answer a form").guess(new) == ["y", "x"]


@_EACH
def test_a_guesser_uses_what_it_says_it_knows(guesser):
    """The answer is in the number of clues or in their place alone; the words are the same."""
    clues = {Knowledge.NUMBER: ((1, 9), (1, 5, 9)), Knowledge.PLACE: ((1,), (501,))}
    for kind, both in clues.items():
        questions = [
            make_question(f"t{i}", "Is it here?", ("yes", "no")[j], both[j])
            for i in range(8)
            for j in range(2)
        ]
        guesses = guesser.guess(make_samples_on_clues(*questions))
        right = sum(
            guess == question.answers[0] for guess, question in zip(guesses, questions, strict=True)
        )
        assert (right == len(questions)) == (kind in guesser.knows)
