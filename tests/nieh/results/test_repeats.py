"""Questions that are asked several times: the seeds, the journal, the figures, and what one repeat
leaves alone."""

import json
import math

import pytest

from infthor_eval.nieh.results.summary import by_question, summarise_repeats
from infthor_eval.nieh.results.tables import tables
from infthor_eval.nieh.suite import NiehSuite
from infthor_eval.report.comparison import compare, comparison_table
from infthor_eval.report.suites.nieh import NiehPresenter
from infthor_eval.runs.journals.shards import FOLDER

from ...helpers.command_line import assert_refused, option_words
from ...helpers.nieh_runs import make_config, make_record, make_run

MODEL = ("--model", "qwen2.5-vl-nano", "--tasks", "nieh_gt")


def make_repeats(number, *replies, **fields):
    return [make_record(number, reply, repeat=at, **fields) for at, reply in enumerate(replies, 1)]


def journal_of(output):
    (shard,) = output.rglob("worker-0.jsonl")
    lines = [json.loads(line) for line in shard.read_text().splitlines()]
    return lines[0], [line for line in lines[1:] if line["type"] == "unit"]


def replies_of(output):
    return {
        (line["id"], line.get("repeat", 1)): line["payload"]["reply"]
        for line in journal_of(output)[1]
    }


def test_each_answer_has_its_record_and_is_drawn_by_its_seed(make_nieh_set, tmp_path, run_cli):
    data = make_nieh_set(size=56)
    for name, options in (
        ("three", ["--repeats", 3]),
        ("first", ["--temperature", 1]),
        ("second", ["--temperature", 1, "--seed", 1]),
        ("cold", ["--repeats", 2, "--temperature", 1e-6]),
    ):
        assert run_cli(*MODEL, "--data", data, "--out", tmp_path / name, *options)[0] == 0
    three = replies_of(tmp_path / "three")
    assert len(three) == 15 and {repeat for _, repeat in three} == {1, 2, 3}
    for repeat, name in ((1, "first"), (2, "second")):
        alone = replies_of(tmp_path / name)
        assert alone == {
            (question, 1): reply for (question, at), reply in three.items() if at == repeat
        }
    assert any(three[question, 1] != three[question, 2] for question, _ in three)
    cold = replies_of(tmp_path / "cold")
    assert all(cold[question, 1] == cold[question, 2] for question, repeat in cold if repeat == 1)


def test_one_repeat_is_a_run_without_the_option(make_nieh_set, tmp_path, run_cli):
    data = make_nieh_set(size=56)
    assert run_cli(*MODEL, "--data", data, "--out", tmp_path)[0] == 0
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.json*") if FOLDER in path.parts}
    _, _, err = run_cli(*MODEL, "--data", data, "--out", tmp_path, "--repeats", 1)
    assert "0 evaluated now, 5 resumed" in err
    assert before == {
        path: path.read_bytes() for path in tmp_path.rglob("*.json*") if FOLDER in path.parts
    }
    header, units = journal_of(tmp_path)
    assert "repeats" not in header["config"] and not any("repeat" in unit for unit in units)
    (results,) = tmp_path.rglob("results.json")
    assert "repeats" not in json.loads(results.read_text())["summary"]


def test_a_baseline_says_the_same_every_time(make_nieh_set, tmp_path, run_cli):
    data = make_nieh_set(size=56)
    code, out, _ = run_cli(
        *option_words(model="oracle", tasks="nieh_gt", data=data, out=tmp_path, repeats=2)
    )
    assert code == 0 and "Answers that repeat" in out
    (rows,) = tmp_path.rglob("samples_nieh_gt_*.jsonl")
    lines = [json.loads(line) for line in rows.read_text().splitlines()]
    assert len(lines) == 5 and all(
        len(set(line["resps"][0])) == 1 and len(line["resps"][0]) == 2 for line in lines
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--repeats", 0], "--repeats 0: give a whole number from 1, at most 10,000"),
        (
            ["--repeats", 2, "--temperature", 0],
            "--temperature 0.0: give a number above 0",
        ),
        (["--temperature", "nan"], "above 0"),
    ],
)
def test_what_draws_nothing_is_refused(make_nieh_set, tmp_path, run_cli, options, message):
    assert_refused(
        run_cli(*MODEL, "--data", make_nieh_set(size=56), "--out", tmp_path, *options), message
    )


def test_the_figures_are_those_of_a_calculation_by_hand():
    # Question 0 is always right, 1 in two of four answers, 2 never; one answer to it failed.
    records = [
        *make_repeats(0, "mug", "Mug", "mug", "mug"),
        *make_repeats(1, "cup", "mug", "mug", "bowl"),
        *make_repeats(2, "cup", "cup", "bowl"),
        make_record(2, None, repeat=4, failure="out of memory"),
    ]
    summary = make_run(make_config(), records).summary
    task, repeats = summary.tasks["nieh_gt"], summary.repeats["nieh_gt"]
    assert (task.n, task.by_clues["total"].n, task.by_clues["total"].n_failed) == (3, 3, 0)
    assert task.by_clues["total"].scores["strict"].mean == repeats.mean == 0.5
    assert [failure.question for failure in task.failures] == ["q2 (4)"]
    assert task.scores["strict"] == {"t0": {"q0": 1.0}, "t1": {"q1": 0.5}, "t2": {"q2": 0.0}}
    assert (repeats.n_repeats, repeats.n_questions) == (4, 3)
    assert (repeats.always, repeats.sometimes, repeats.never) == (1 / 3, 1 / 3, 1 / 3)
    assert repeats.consensus == 2 / 3  # "mug" twice against "cup" and "bowl"
    assert repeats.agreement == pytest.approx((1 + 0.5 + 2 / 3) / 3)
    assert repeats.variance_within == pytest.approx((1 / 3) / 3)  # of 0, 1, 1, 0: a third
    noise = (1 / 3 / 4) / 3
    assert repeats.variance_between == pytest.approx(0.25 - noise)
    assert repeats.drawing == pytest.approx(1.96 * math.sqrt(1 / 3 / 4) / 3)
    single = by_question([make_record(0, "mug"), make_record(1, "mug")])
    assert summarise_repeats(single, "strict") is None
    (table,) = [
        table for table in tables([make_run(make_config(), records)]) if "repeat" in table.title
    ]
    assert table.rows[0].cells[2:5] == ("4x", "3", "50.0")


def test_repeated_runs_are_compared_by_the_means_of_their_questions():
    once = [make_record(number, reply) for number, reply in enumerate(("mug", "cup") * 2)]
    often = [answer for number in range(4) for answer in make_repeats(number, "mug", "cup")]
    strict = {one.metric: one for one in compare(NiehSuite(), NiehPresenter(), once, often)}[
        "strict"
    ]
    assert (strict.first, strict.second, strict.difference.estimate.n) == (0.5, 0.5, 4)
    assert strict.drawing is None and strict.n_unshared == 0
    comparisons = compare(NiehSuite(), NiehPresenter(), often, often[::-1])
    strict = {one.metric: one for one in comparisons}["strict"]
    assert strict.difference.estimate.mean == 0
    assert strict.drawing == pytest.approx(1.96 * math.sqrt(8 * 0.5 / 2) / 4)
    table = comparison_table(comparisons, "a", "b")
    assert table.columns[-1].name == "drawing" and table.rows[0].cells[-1].startswith("±")
