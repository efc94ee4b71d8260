"""Scores above guessing: against the formula, by form, as it is written."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.nieh.above_guessing import SOLVED, above_guessing, score_above_guessing
from infthor_eval.nieh.records import Guess

from .made import record


def guess(form, own, of_form):
    return Guess(form=form, scores={"strict": own}, form_scores={"strict": of_form})


def records_of(forms):
    """Records of forms, each a list of pairs: the score, and that of the guess."""
    made = []
    for form, pairs in forms.items():
        mean = sum(guessed for _, guessed in pairs) / len(pairs)
        for score, guessed in pairs:
            about = {"scores": {"strict": score}, "guess": guess(form, guessed, mean)}
            made.append(record(len(made), "mug", cluster=f"t{len(made) % 3}", **about))
    return made


PAIRS = st.lists(st.tuples(st.sampled_from([0.0, 0.5, 1.0]), st.sampled_from([0.0, 1.0])), min_size=1, max_size=12)


@given(st.dictionaries(st.sampled_from("abcd"), PAIRS, min_size=1))
def test_forms_are_pooled_by_their_questions(forms):
    """The sum over forms of n (s - g) / (1 - g), over the number of their questions; solved forms are left out."""
    total, n = 0.0, 0
    for pairs in forms.values():
        score, guessed = (sum(column) / len(pairs) for column in zip(*pairs, strict=True))
        if guessed <= SOLVED:
            total += len(pairs) * (score - guessed) / (1 - guessed)
            n += len(pairs)
    above = above_guessing(records_of(forms), "strict")
    assert above.n == n
    assert above.n_solved == sum(map(len, forms.values())) - n
    assert above.mean == (pytest.approx(total / n) if n else None)


def test_all_right_is_1_and_the_guesser_itself_0():
    guesses = [1.0, 0.0, 0.0, 1.0, 0.0]
    assert above_guessing(records_of({"a": [(1.0, g) for g in guesses]}), "strict").mean == pytest.approx(1)
    assert above_guessing(records_of({"a": [(g, g) for g in guesses]}), "strict").mean == pytest.approx(0)


def test_a_form_that_guessing_solves_is_named_and_not_counted():
    above = above_guessing(records_of({"yes": [(0.0, 1.0)] * 4, "where": [(1.0, 0.0), (0.0, 0.0)]}), "strict")
    assert (above.mean, above.n, above.n_solved, above.solved_forms) == (0.5, 2, 4, ["yes"])
    assert {form: (it.n, it.score, it.guess) for form, it in above.forms.items()} == {
        "yes": (4, 0.0, 1.0),
        "where": (2, 0.5, 0.0),
    }


def test_a_failed_model_is_wrong_and_a_question_without_a_guess_is_counted_apart():
    failed = record(0, None, failure="too long", guess=guess("a", 1.0, 0.5))
    assert score_above_guessing(failed.payload, "strict") == pytest.approx((0 - 1) / (1 - 0.5))
    above = above_guessing([failed, record(1, "mug")], "strict")
    assert (above.mean, above.n, above.n_unknown) == (pytest.approx(-2), 1, 1)
    assert above_guessing([record(1, "mug")], "strict").mean is None


def test_the_interval_is_over_trajectories():
    about = [{"guess": guess("a", 0.0, 0.0), "scores": {"strict": n % 2}} for n in range(6)]
    one = [record(n, "mug", cluster="t", **fields) for n, fields in enumerate(about)]
    assert above_guessing(one, "strict").low is None
    two = [record(n, "mug", cluster=f"t{n % 2}", **fields) for n, fields in enumerate(about)]
    above = above_guessing(two, "strict")
    assert (above.low, above.mean, above.high) == (0.0, 0.5, 1.0)  # either trajectory may be drawn twice
