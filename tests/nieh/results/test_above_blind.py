"""The share of what cannot be guessed that a run got, against its formula and by hand."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_eval.nieh.records import BlindGuess
from infthor_eval.nieh.results.above_blind import (
    SOLVED,
    FormScore,
    above_blind,
    score_above_blind,
)

from ...helpers.nieh_runs import make_record

# Scores and guesses in quarters; a mean guess of a form that is above SOLVED can only be 1.
_QUARTERS = st.integers(0, 4).map(lambda quarters: quarters / 4)
_PAIRS = st.lists(st.tuples(_QUARTERS, _QUARTERS), min_size=1, max_size=8)
_FORMS = st.dictionaries(st.sampled_from("abcd"), _PAIRS, min_size=1)


def guess(score, mean=None, form="a", scorer="strict"):
    """A guess with that score at a question, and that mean at its form."""
    return BlindGuess(
        form=form, scores={scorer: score}, form_scores={scorer: score if mean is None else mean}
    )


def answered(forms):
    """Records of some forms, each with pairs of the run's score and the guesser's."""
    items = []
    for form, pairs in forms.items():
        mean = sum(guessed for _, guessed in pairs) / len(pairs)
        items += [(score, guess(guessed, mean, form)) for score, guessed in pairs]
    return [
        make_record(number, "?", scores={"strict": score}, blind=at)
        for number, (score, at) in enumerate(items)
    ]


@settings(max_examples=40)
@given(_FORMS)
def test_it_is_the_mean_of_the_forms_weighted_by_their_questions(forms):
    above = above_blind(answered(forms), "strict")
    total = n = 0
    for pairs in forms.values():
        score, guessed = (sum(column) / len(pairs) for column in zip(*pairs, strict=True))
        if guessed <= SOLVED:
            total += len(pairs) * (score - guessed) / (1 - guessed)
            n += len(pairs)
    assert above.n == n
    assert above.mean == (pytest.approx(total / n) if n else None)
    assert above.n_solved == sum(map(len, forms.values())) - n
    assert above.forms.keys() == forms.keys()


@settings(max_examples=40)
@given(_FORMS)
def test_the_guesser_itself_gets_nothing_and_all_right_is_all(forms):
    guessed = {form: [(right, right) for _, right in pairs] for form, pairs in forms.items()}
    all_right = {form: [(1.0, right) for _, right in pairs] for form, pairs in forms.items()}
    none, whole = (above_blind(answered(records), "strict") for records in (guessed, all_right))
    assert none.mean == (pytest.approx(0) if none.n else None)
    assert whole.mean == (pytest.approx(1) if whole.n else None)


def test_a_form_that_guessing_solves_is_left_out_and_counted():
    records = [
        make_record(i, "?", scores={"strict": 0.0}, blind=guess(1.0, 0.96, "easy"))
        for i in range(3)
    ]
    alone = above_blind(records, "strict")
    assert (alone.mean, alone.low, alone.n, alone.n_solved) == (None, None, 0, 3)
    assert alone.forms == {"easy": FormScore(3, 0.0, 1.0)}
    border = make_record(3, "?", scores={"strict": 1.0}, blind=guess(0.0, SOLVED, "hard"))
    both = above_blind([*records, border], "strict")
    assert (both.mean, both.n, both.n_solved) == (pytest.approx(20.0), 1, 3)
    assert alone.solved_forms == both.solved_forms == ["easy"]


def test_a_question_on_which_the_model_failed_counts_as_wrong():
    failed = make_record(0, None, failure="too long", blind=guess(0.25))
    above = above_blind(
        [failed, make_record(1, "?", scores={"strict": 1.0}, blind=guess(0.25))], "strict"
    )
    assert above.forms == {"a": FormScore(2, 0.5, 0.25)}
    assert above.mean == pytest.approx((0.5 - 0.25) / 0.75)


def test_questions_whose_guess_is_not_known_are_counted():
    other = guess(0.5, scorer="reference")
    records = [
        make_record(0, "mug"),
        make_record(1, "mug", blind=other),
        make_record(2, "mug", blind=guess(0.5)),
    ]
    above = above_blind(records, "strict")
    assert (above.mean, above.n, above.n_unknown) == (1.0, 1, 2)
    assert [score_above_blind(item.payload, "strict") for item in records] == [None, None, 1.0]
    assert above_blind([], "strict").mean is None


def test_a_form_in_two_files_is_two_forms():
    easy, hard = guess(0.75), guess(0.5)
    records = [
        make_record(0, "mug", blind=easy, file="f"),
        make_record(1, "mug", blind=hard, file="g"),
    ]
    assert above_blind(records, "strict").forms == {
        "f: a": FormScore(1, 1.0, 0.75),
        "g: a": FormScore(1, 1.0, 0.5),
    }


def test_one_trajectory_gives_no_interval():
    records = [
        make_record(4 * i, "?", scores={"strict": float(i)}, blind=guess(0.5)) for i in range(2)
    ]
    above = above_blind(records, "strict")
    assert (above.mean, above.low, above.high) == (0.0, None, None)
