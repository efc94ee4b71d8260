"""The longest context at which a model keeps 85 % of its score on the clue frames."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.nieh.records import BlindGuess
from infthor_eval.nieh.results.effective_length import (
    KEPT,
    effective_length,
    effective_lengths,
    find_series,
)
from infthor_eval.runs import Tokens

from ...helpers.nieh_runs import make_config, make_record, make_run


@pytest.mark.parametrize(
    ("base", "scores", "expected"),
    [
        (0.8, {"8": 0.8, "16": 0.7, "32": 0.6, "64": 0.5}, "16K"),  # 85 % of 0.8 is 0.68
        (1.0, {"8": 0.85, "16": 0.849}, "8K"),
        (0.6, {"8": 0.51}, "8K, all that were asked"),
        # The border itself, which rounding puts a hair below.
        (20 / 29, {"8": 17 / 29, "16": 0.1}, "8K"),
        (0.8, {"8": 0.9, "16": 0.9}, "16K, all that were asked"),
        (0.8, {"8": 0.1, "16": 0.9}, "below 8K"),
        # What is got back beyond a loss does not count.
        (0.8, {"8": 0.8, "16": 0.1, "32": 0.9}, "8K"),
        (0.8, {"8": None, "16": 0.8, "32": 0.2}, "16K"),
        (0.8, {"8": None}, "-"),
        (0.8, {}, "-"),
        (0.0, {"8": 0.0}, "-"),
        (-0.2, {"8": 0.0}, "-"),
        (None, {"8": 0.9}, "-"),
    ],
)
def test_the_rule(base, scores, expected):
    assert effective_length(base, scores) == expected


@given(st.integers(1, 20), st.integers(1, 50))
def test_what_is_just_85_percent_is_kept_whatever_the_number_of_questions(twentieths, more):
    n = 20 * twentieths + more
    right, kept = 20 * twentieths, 17 * twentieths
    assert effective_length(right / n, {"8": kept / n}) == "8K, all that were asked"
    assert effective_length(right / n, {"8": (kept - 1) / n}) == "below 8K"
    assert KEPT == 17 / 20


def of_share(share, n=20, **changes):
    return [make_record(i, "mug" if i < share * n else "cup", **changes) for i in range(n)]


def sized(context, size, share, model="qwen2.5-vl"):
    return make_run(make_config(model=model, context=context, ctx_size=size), of_share(share))


ON_CLUES = make_run(make_config(), of_share(0.8))


def test_a_row_per_kind_of_context_and_scorer_with_sizes_in_order():
    runs = [sized("haystack", size, share) for size, share in ((32, 0.5), (8, 0.8), (16, 0.7))]
    (table,) = effective_lengths([*runs, ON_CLUES, sized("truncate_head", 64, 0.2)])
    assert [row.cells for row in table.rows] == [
        ("a run", context, scorer, "80.0", length, "-", "-", scores)
        for context, length, scores in (
            ("haystack", "16K", "8K 80.0, 16K 70.0, 32K 50.0"),
            ("truncate_head", "below 64K", "64K 20.0"),
        )
        for scorer in ("reference", "strict")
    ]


def test_whole_trajectories_are_in_bins_of_their_length():
    replies = (("mug", 900), ("mug", 40_000), ("mug", 63_999), ("cup", 64_000), ("mug", None))
    records = [
        make_record(i, reply, tokens=Tokens(context=n)) for i, (reply, n) in enumerate(replies)
    ]
    (series, _) = find_series([ON_CLUES, make_run(make_config(context="trajectory"), records)])
    assert [(point.length, point.score) for point in series.points] == [
        ("0-1", 1.0),
        ("32-64", 1.0),
        ("64-128", 0.0),
    ]
    (table,) = effective_lengths([ON_CLUES, make_run(make_config(context="trajectory"), records)])
    assert {row.cells[4] for row in table.rows} == {"32-64K"}


def test_the_same_rule_holds_above_blind():
    guess = BlindGuess(form="a", scores={"strict": 0.5}, form_scores={"strict": 0.5})
    base, far = (of_share(share, blind=guess) for share in (1.0, 0.9))
    runs = [
        make_run(make_config(), base),
        make_run(make_config(context="haystack", ctx_size=8), far),
    ]
    (table,) = effective_lengths(runs)
    (row,) = [row for row in table.rows if row.cells[2] == "strict"]
    # 90 % is kept of 100 %, but only 80 % of what cannot be guessed.
    assert row.cells[3:7] == ("100.0", "8K, all that were asked", "100.0", "below 8K")


def test_without_a_run_on_the_clue_frames_there_is_none():
    runs = [sized("haystack", 8, 0.8)]
    others = [
        make_run(make_config(model="other"), of_share(0.8)),
        make_run(make_config(frames="blank"), of_share(0.8)),
        make_run(make_config(), []),
    ]
    for other in others:
        assert effective_lengths([*runs, other]) == []
    assert effective_lengths([ON_CLUES]) == []
    assert effective_lengths([ON_CLUES, sized("haystack", 8, 0.8, model="other")]) == []
    empty = make_run(make_config(context="haystack", ctx_size=8), [])
    assert effective_lengths([ON_CLUES, empty])[0].rows[0].cells[4] == "-"


def test_a_metric_that_one_of_the_tasks_alone_has_is_left_out_there():
    records = [make_record(0, "mug", scores={"strict": 1.0, "length": 3.0})]
    base = make_run(make_config(metrics=("strict", "length")), records)
    whole = make_run(
        make_config(context="trajectory"), [make_record(0, "mug", tokens=Tokens(context=900))]
    )
    (table,) = effective_lengths([base, whole, sized("haystack", 8, 0.8)])
    assert [row.cells[1:3] for row in table.rows] == [
        ("trajectory", "strict"),
        ("haystack", "strict"),
    ]
