from itertools import pairwise

import msgspec
import pytest

from infthor_eval.distances import DISTANCES, LENGTHS
from infthor_eval.nieh.records import BlindGuess, ShownClues
from infthor_eval.nieh.results.summary import NiehSummary
from infthor_eval.runs import Tokens

from ...helpers.nieh_runs import make_config, make_record, make_run


def summarise(config, records):
    return make_run(config, records).summary


def test_the_same_records_in_another_order_give_the_same_summary():
    records = [
        make_record(number, "mug" if number % 3 else "cup", n_clues=1 + number % 4)
        for number in range(20)
    ]
    summary = summarise(make_config(), records)
    assert summary == summarise(make_config(), records[::-1])
    assert msgspec.json.decode(msgspec.json.encode(summary), type=NiehSummary) == summary


def test_columns_are_those_of_table_4_and_both_denominators_are_told():
    records = [
        make_record(0, "mug"),
        make_record(1, "cup"),
        make_record(2, "mug", n_clues=2),
        make_record(3, "mug", n_clues=7),
    ]
    records.append(make_record(4, "no", answers=("no",), n_clues=0))
    result = summarise(make_config(skipped=("no clue frame", "no clue frame")), records).tasks[
        "nieh_gt"
    ]
    by_clues = {
        name: (cell.n, cell.scores["strict"].mean) for name, cell in result.by_clues.items()
    }
    assert by_clues == {
        "1": (2, 0.5),
        "2": (1, 1.0),
        ">=3": (1, 1.0),
        "total": (5, 0.8),
        "absence": (1, 1.0),
        "open-ended": (4, 0.75),
    }
    assert (result.n, result.context, result.metrics) == (5, "clues", ["reference", "strict"])
    assert (result.skipped.n, result.skipped.by_reason) == (2, {"no clue frame": 2})
    assert result.skipped.mean_counting_them_wrong["strict"] == 4 / 7
    assert result.below_full_marks["strict"] == ["q1"]


def test_open_ended_is_what_begins_with_a_text_that_is_neither_yes_nor_no():
    golds = [("mug",), ("Mug", "yes"), ("3",), ("yes",), ("No",), (3,), (2, "mug")]
    records = [make_record(number, "?", answers=answers) for number, answers in enumerate(golds)]
    assert summarise(make_config(), records).tasks["nieh_gt"].by_clues["open-ended"].n == 3


def test_a_column_without_a_question_has_no_score():
    result = summarise(make_config(), [make_record(0, "mug")]).tasks["nieh_gt"]
    assert (result.by_clues["2"].n, result.by_clues["2"].scores) == (0, {})
    alone = result.by_clues["total"].scores["strict"]
    assert (alone.mean, alone.n_trajectories) == (1.0, 1)
    assert (alone.stderr, alone.low, alone.high, alone.bootstrap) == (None, None, None, None)


def test_a_failed_question_is_in_no_score_and_is_named():
    result = summarise(
        make_config(), [make_record(0, "mug"), make_record(1, None, failure="too long")]
    ).tasks["nieh_gt"]
    assert result.total.scores["strict"].mean == 1.0
    assert (result.n, result.total.n_failed, result.total.n_answered) == (2, 1, 1)
    assert result.below_full_marks["strict"] == []
    assert result.skipped.mean_counting_them_wrong["strict"] == 0.5
    assert [(failure.question, failure.reason) for failure in result.failures] == [
        ("q1", "too long")
    ]


def test_scores_are_those_of_the_tasks_own_metrics():
    records = [
        make_record(0, "mug", scores={"length": 3.0}),
        make_record(1, "cups", scores={"length": 4.0}),
    ]
    result = summarise(make_config(metrics=("length",)), records).tasks["nieh_gt"]
    assert {name: score.mean for name, score in result.by_clues["total"].scores.items()} == {
        "length": 3.5
    }
    assert result.below_full_marks == {"length": []}


def test_types_and_variants_are_apart():
    records = [
        make_record(0, "mug", question_type="", variant="depth=0"),
        make_record(1, "cup", variant="depth=0.2"),
    ]
    result = summarise(make_config(), records).tasks["nieh_gt"]
    assert {name: cell.n for name, cell in result.by["question_type"].items()} == {
        "put_action": 1,
        "untyped": 1,
    }
    assert {name: cell.scores["strict"].mean for name, cell in result.by["variant"].items()} == {
        "depth=0": 1.0,
        "depth=0.2": 0.0,
    }
    assert result.below_full_marks["strict"] == ["q1 depth=0.2"]


def test_a_leaning_to_yes_and_a_reply_that_is_neither_show():
    replies = ["yes", "Yes.", "yes", "maybe"]
    records = [
        make_record(i, reply, answers=("yes",) if i < 1 else ("no",))
        for i, reply in enumerate(replies)
    ]
    yes_no = summarise(make_config(), [*records, make_record(9, "mug")]).tasks["nieh_gt"].yes_no
    assert msgspec.to_builtins(yes_no) == {
        "n": 4,
        "share_gold_yes": 0.25,
        "share_said_yes": 0.75,
        "n_neither": 1,
    }


# -- by file, evidence and length


def task_of(records):
    return summarise(make_config(), records).tasks["nieh_gt"]


def make_shown_clues(n_shown, n_clues=2, n_after=None):
    return ShownClues(n_shown=n_shown, n_clues=n_clues, n_after=n_after)


def means(cells):
    return {name: (cell.n, cell.scores["strict"].mean) for name, cell in cells.items()}


def test_files_are_apart_in_a_set_of_several():
    records = [
        make_record(0, "mug", file="b"),
        make_record(1, "cup", file="b"),
        make_record(2, "mug", file="a"),
    ]
    assert list(means(task_of(records).by["file"]).items()) == [("a", (1, 1.0)), ("b", (2, 0.5))]
    alone = task_of([make_record(0, "mug")])
    assert (alone.by["file"], alone.files) == ({}, {})


def test_samples_are_apart_by_the_share_of_their_clues_that_was_shown():
    states = ((0, "a"), (2, "a"), (1, "b"), (0, "b"), (1, "a"))
    records = [
        make_record(i, "mug" if i else "cup", file=file, shown_clues=make_shown_clues(n))
        for i, (n, file) in enumerate(states)
    ]
    task = task_of([*records, make_record(9, "mug", file="a")])  # of the last it is not known
    evidence = {"total": task.by, **task.files}
    assert {name: list(means(by["shown_clues"]).items()) for name, by in evidence.items()} == {
        "total": [("all", (1, 1.0)), ("some", (2, 1.0)), ("none", (2, 0.5))],
        "a": [("all", (1, 1.0)), ("some", (1, 1.0)), ("none", (1, 0.0))],
        "b": [("some", (1, 1.0)), ("none", (1, 1.0))],
    }
    assert all(by["distance"] == {} for by in evidence.values())


@pytest.mark.parametrize(
    ("facet", "value", "name"),
    [
        *[("distance", 0, "0-49"), ("distance", 49, "0-49"), ("distance", 50, "50-99")],
        *[("distance", 1599, "800-1599"), ("distance", 1600, "1600-3199")],
        *[("distance", 3200, ">=3200"), ("length", 0, "0-1"), ("length", 999, "0-1")],
        *[("length", 1000, "1-2"), ("length", 32_768, "32-64")],
        *[("length", 1_023_999, "512-1024"), ("length", 1_024_000, ">=1024")],
    ],
)
def test_samples_are_apart_by_the_distance_of_their_last_clue_and_the_length_of_their_context(
    facet, value, name
):
    clues, tokens = make_shown_clues(2, n_after=value), Tokens(context=value)
    about = {"shown_clues": clues} if facet == "distance" else {"tokens": tokens}
    by_facet = task_of([make_record(0, "mug", **about), make_record(1, "cup")]).by[facet]
    assert means(by_facet) == {name: (1, 1.0)}


def test_lengths_have_their_own_scores_above_blind():
    guess = BlindGuess(form="f", scores={"strict": 0.5}, form_scores={"strict": 0.5})
    lengths = (("mug", 500), ("cup", 500), ("mug", 70_000), ("mug", 3000))
    records = [
        make_record(i, reply, tokens=Tokens(context=n), blind=guess)
        for i, (reply, n) in enumerate(lengths[:3])
    ]
    summary = task_of([*records, make_record(3, "mug", tokens=Tokens(context=3000))])
    assert {name: at["strict"] for name, at in summary.above_blind_by_length.items()} == {
        "0-1": 0.0,
        "2-4": None,  # its guess is not known
        "64-128": 1.0,
    }
    assert list(summary.by["length"]) == ["0-1", "2-4", "64-128"]
    assert summary.above_blind["strict"].mean == pytest.approx(1 / 3)
    assert summary.above_blind["strict"].n_unknown == 1


@pytest.mark.parametrize("names", [DISTANCES, LENGTHS])
def test_bins_follow_each_other_without_a_gap(names):
    ends = [tuple(map(int, name.split("-"))) for name in names[:-1]]
    # The last frame of a bin is in its name, the last token is not.
    step = 1 if names is DISTANCES else 0
    assert all(before[1] + step == after[0] for before, after in pairwise(ends))
    assert (ends[0][0], names[-1]) == (0, f">={ends[-1][1] + step}")
