"""Two runs on the same questions, also in scores that not every question has."""

import pytest
from msgspec.structs import replace

from infthor_eval.errors import DataError
from infthor_eval.nieh.records import Guess
from infthor_eval.nieh.suite import NiehSuite
from infthor_eval.report.comparison import compare, comparison_table
from infthor_eval.report.plain import PlainPresenter
from infthor_eval.report.suites.nieh import NiehPresenter

from ..nieh.made import record

ABOVE = "strict, above guessing"


def asked(number, reply, score=0.5, mean=0.5):
    return record(
        number, reply, guess=Guess(form="f", scores={"strict": score}, form_scores={"strict": mean})
    )


def compared(first, second, presenter=None):
    return {
        one.metric: one for one in compare(NiehSuite(), presenter or NiehPresenter(), first, second)
    }


def test_further_scores_are_those_above_guessing_where_guessing_does_not_solve_the_form():
    presenter = NiehPresenter()
    assert presenter.further_scores(asked(0, "mug", 0.0)) == {ABOVE: 2.0}
    assert presenter.further_scores(asked(0, "cup", 1.0)) == {ABOVE: -2.0}
    assert presenter.further_scores(asked(0, None, 0.25, 0.75)) == {ABOVE: -1.0}
    assert presenter.further_scores(asked(0, "mug", 1.0, 0.96)) == {}
    assert presenter.further_scores(record(0, "mug")) == {}
    assert PlainPresenter().further_scores(asked(0, "mug")) == {}


def test_runs_are_compared_above_guessing_on_the_questions_that_have_it():
    # Question 0 has no guess and 1 is solved by guessing; the others count, of one form with a
    # guess of 0.5 each.
    replies = (
        ("mug", "mug", "cup", "cup", "mug", "mug"),
        ("mug", "cup", "mug", "mug", "mug", "cup"),
    )
    runs = [
        [record(0, first), asked(1, second, 1.0, 1.0), *map(asked, (2, 3, 6, 7), counted)]
        for first, second, *counted in replies
    ]
    found = compared(*runs)
    assert list(found) == ["reference", "strict", ABOVE]
    plain, above = found["strict"], found[ABOVE]
    assert (plain.first, plain.second, plain.difference.estimate.n) == (4 / 6, 4 / 6, 6)
    # From 2 of 4 right to 3 of 4: (0.5 - 0.5) / 0.5 = 0 and (0.75 - 0.5) / 0.5 = 0.5.
    assert (above.first, above.second, above.difference.estimate.n) == (0.0, 0.5, 4)
    assert (above.difference.estimate.mean, above.difference.estimate.n_clusters) == (
        pytest.approx(0.5),
        2,
    )
    assert above.is_share
    row = comparison_table(found.values(), "a", "b").rows[-1].cells
    assert row[:6] == ("nieh_gt", ABOVE, "%", "0.00", "50.00", "+50.00")
    assert row[-2:] == ("4", "0")


def test_a_question_that_only_one_run_has_it_for_is_not_compared_in_it():
    first = [asked(0, "mug"), asked(1, "mug"), record(2, "mug")]
    second = [asked(0, "cup"), record(1, "cup"), asked(2, "cup")]
    found = compared(first, second)
    assert (found["strict"].difference.estimate.n, found[ABOVE].difference.estimate.n) == (3, 1)
    assert (found[ABOVE].first, found[ABOVE].second) == (1.0, -1.0)
    assert ABOVE not in compared(first[:2], [record(0, "mug"), record(1, "mug")])
    assert ABOVE not in compared(first, second, PlainPresenter())


def test_a_metric_that_one_run_has_not_is_not_compared():
    """A task may have the reference scorer alone; to a run without any result, every metric is
    0."""
    alone = [asked(0, "mug"), asked(1, None)]
    alone[0] = replace(alone[0], payload=replace(alone[0].payload, scores={"reference": 1.0}))
    both = [asked(0, "mug"), asked(1, "mug")]
    assert list(compared(alone, both)) == list(compared(both, alone)) == ["reference"]
    assert list(compared([asked(0, None)], both)) == ["reference", "strict", ABOVE]


def test_units_that_one_run_alone_has_are_counted_and_without_a_shared_one_there_is_an_error():
    found = compared(
        [asked(0, "mug"), asked(1, "mug")], [asked(1, "mug"), asked(2, "mug"), asked(3, "mug")]
    )
    assert {metric: one.n_unshared for metric, one in found.items()} == {
        "reference": 3,
        "strict": 3,
        ABOVE: 3,
    }
    with pytest.raises(DataError, match="share no unit of the same task"):
        compared([record(0, "mug")], [record(1, "mug")])
