"""Two runs on the same questions, also in scores that not every question has."""

import pytest
from msgspec.structs import replace

from infthor_eval.errors import DataError
from infthor_eval.nieh.records import BlindGuess
from infthor_eval.nieh.suite import NiehSuite
from infthor_eval.report.comparison import compare, comparison_table
from infthor_eval.report.plain import PlainPresenter
from infthor_eval.report.suites.nieh import NiehPresenter

from ..helpers.nieh_runs import make_record, make_twins

ABOVE = "strict, above blind"


def make_guessed_record(number, reply, score=0.5, mean=0.5):
    return make_record(
        number,
        reply,
        blind=BlindGuess(form="f", scores={"strict": score}, form_scores={"strict": mean}),
    )


def compared(first, second, presenter=None):
    return {
        one.metric: one for one in compare(NiehSuite(), presenter or NiehPresenter(), first, second)
    }


def test_extra_scores_are_those_above_blind_where_guessing_does_not_solve_the_form():
    presenter = NiehPresenter()
    assert presenter.extra_scores(make_guessed_record(0, "mug", 0.0)) == {ABOVE: 2.0}
    assert presenter.extra_scores(make_guessed_record(0, "cup", 1.0)) == {ABOVE: -2.0}
    assert presenter.extra_scores(make_guessed_record(0, None, 0.25, 0.75)) == {ABOVE: -1.0}
    assert presenter.extra_scores(make_guessed_record(0, "mug", 1.0, 0.96)) == {}
    assert presenter.extra_scores(make_record(0, "mug")) == {}
    assert PlainPresenter().extra_scores(make_guessed_record(0, "mug")) == {}


def test_runs_are_compared_above_blind_on_the_questions_that_have_it():
    # Question 0 has no guess and 1 is solved by guessing; the others count, of one form with a
    # guess of 0.5 each.
    replies = (
        ("mug", "mug", "cup", "cup", "mug", "mug"),
        ("mug", "cup", "mug", "mug", "mug", "cup"),
    )
    runs = [
        [
            make_record(0, first),
            make_guessed_record(1, second, 1.0, 1.0),
            *map(make_guessed_record, (2, 3, 6, 7), counted),
        ]
        for first, second, *counted in replies
    ]
    comparisons = compared(*runs)
    assert list(comparisons) == ["reference", "strict", ABOVE]
    plain, above = comparisons["strict"], comparisons[ABOVE]
    assert (plain.first, plain.second, plain.difference.estimate.n) == (4 / 6, 4 / 6, 6)
    # From 2 of 4 right to 3 of 4: (0.5 - 0.5) / 0.5 = 0 and (0.75 - 0.5) / 0.5 = 0.5.
    estimate = above.difference.estimate
    assert (above.first, above.second, estimate.n, estimate.n_clusters) == (0.0, 0.5, 4, 2)
    assert estimate.mean == pytest.approx(0.5)
    assert above.is_share
    row = comparison_table(comparisons.values(), "a", "b").rows[-1].cells
    assert row[:6] == ("nieh_gt", ABOVE, "%", "0.00", "50.00", "+50.00")
    assert row[-2:] == ("4", "0")


def test_a_question_that_only_one_run_has_it_for_is_not_compared_in_it():
    first = [make_guessed_record(0, "mug"), make_guessed_record(1, "mug"), make_record(2, "mug")]
    second = [make_guessed_record(0, "cup"), make_record(1, "cup"), make_guessed_record(2, "cup")]
    comparisons = compared(first, second)
    counted = [comparisons[metric].difference.estimate.n for metric in ("strict", ABOVE)]
    assert counted == [3, 1]
    assert (comparisons[ABOVE].first, comparisons[ABOVE].second) == (1.0, -1.0)
    assert ABOVE not in compared(first[:2], [make_record(0, "mug"), make_record(1, "mug")])
    assert ABOVE not in compared(first, second, PlainPresenter())


def test_a_metric_that_one_run_has_not_is_not_compared():
    """A task may have the reference scorer alone."""
    alone = [make_guessed_record(0, "mug"), make_guessed_record(1, None)]
    alone[0] = replace(alone[0], payload=replace(alone[0].payload, scores={"reference": 1.0}))
    both = [make_guessed_record(0, "mug"), make_guessed_record(1, "mug")]
    assert list(compared(alone, both)) == list(compared(both, alone)) == ["reference"]


def test_a_question_without_a_reply_in_one_run_is_not_compared():
    first = [make_guessed_record(0, "mug"), make_guessed_record(1, None)]
    second = [make_guessed_record(0, "mug"), make_guessed_record(1, "mug")]
    comparisons = compared(first, second)
    assert {one.difference.estimate.n for one in comparisons.values()} == {1}
    assert {one.n_unshared for one in comparisons.values()} == {1}
    with pytest.raises(DataError, match="with a result in both"):
        compared([make_guessed_record(0, None)], second)


def test_units_that_one_run_alone_has_are_counted_and_without_a_shared_one_there_is_an_error():
    first, second = (
        [make_guessed_record(number, "mug") for number in numbers]
        for numbers in ((0, 1), (1, 2, 3))
    )
    unshared = {metric: one.n_unshared for metric, one in compared(first, second).items()}
    assert unshared == {"reference": 3, "strict": 3, ABOVE: 3}
    with pytest.raises(DataError, match="share no unit of the same task"):
        compared([make_record(0, "mug")], [make_record(1, "mug")])


BOTH = ("bowl", "sofa")
SAME = ("bowl", "bowl")
SWAPPED = ("sofa", "bowl")


def test_runs_are_compared_on_pairs_of_twins_clustered_by_what_they_were_made_of():
    # By base: t has pairs 0 and 1, u has 2, v has 3.
    places = ((0, "t"), (1, "t"), (2, "u"), (3, "v"))
    first, second = (
        [
            record
            for (number, base), replies in zip(places, of_run, strict=True)
            for record in make_twins(number, replies, base)
        ]
        for of_run in ((SAME, SAME, BOTH, SWAPPED), (BOTH, BOTH, BOTH, SAME))
    )
    comparisons = compared(first, second)
    assert list(comparisons) == [
        *("net_pairs", "pair_accuracy", "pairs_exchanged", "reference", "strict")
    ]
    pairs = comparisons["net_pairs"]
    assert (pairs.first, pairs.second) == (0.0, 0.75)  # the first exchanges the worlds of one pair
    assert comparisons["pair_accuracy"].first == comparisons["pairs_exchanged"].first == 0.25
    assert (pairs.difference.estimate.n, pairs.difference.estimate.n_clusters) == (4, 3)
    assert pairs.difference.estimate.mean == pytest.approx(0.75)
    assert (pairs.is_share, pairs.n_unshared, pairs.drawing) == (True, 0, None)
    # Single answers alone hide it: half of them are right where a pair is answered the same.
    strict = comparisons["strict"]
    assert (strict.first, strict.second, strict.difference.estimate.n) == (0.5, 0.875, 8)
    assert "net_pairs" not in compared(first, second, PlainPresenter())


def test_a_pair_that_one_run_has_not_is_counted_and_repetitions_are_one_pair():
    first = [*make_twins(0, BOTH, "t"), *make_twins(1, SAME, "u")]
    again = [replace(record, repeat=2) for record in make_twins(0, SAME, "t")]
    second = [*make_twins(0, BOTH, "t"), *again, *make_twins(1, BOTH, "u")[:1]]
    pairs = compared(first, second)["net_pairs"]
    assert (pairs.first, pairs.second, pairs.difference.estimate.n) == (1.0, 0.5, 1)
    assert pairs.n_unshared == 1
    row = comparison_table([pairs], "a", "b").rows[0].cells
    assert row[:6] == ("nieh_gt", "net_pairs", "%", "100.00", "50.00", "-50.00")


def test_pairs_of_a_task_without_the_strict_scorer_are_compared_in_its_own():
    def own(records):
        return [
            replace(it, payload=replace(it.payload, scores={"own": it.payload.scores["strict"]}))
            for it in records
        ]

    first, second = (own(make_twins(0, replies, "t")) for replies in (SAME, BOTH))
    pairs = compared(first, second)["pair_accuracy"]
    assert (pairs.first, pairs.second) == (0.0, 1.0)
