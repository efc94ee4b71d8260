import dataclasses
import json
import re

import pytest
from msgspec.structs import replace

from infthor_eval.plans.records import StepRecord

from ...conftest import QUESTIONS
from ...helpers.command_line import assert_refused, read_success
from ...helpers.journals import write_run
from ...helpers.plan_runs import make_plan_record, make_plans_run
from ...helpers.printed import read_rows


def test_two_runs_are_compared_question_by_question(make_nieh_set, run_cli, evaluate):
    data = make_nieh_set(size=56)
    oracle, blind = (evaluate(model, data=data) for model in ("oracle", "blind"))
    code, out, _ = run_cli("compare", blind, oracle)
    rows = [line.split() for line in out.splitlines()]
    assert code == 0
    (row,) = [row for row in rows if row[:2] == ["nieh_gt", "strict"]]
    assert (row[2], row[4]) == ("%", "100.00")
    assert float(row[5]) == pytest.approx(100 - float(row[3]), abs=0.01)
    assert row[-2:] == ["5", "0"]
    code, out, _ = run_cli("compare", oracle, oracle)
    assert "+0.00" in out
    assert "1.0000" in out
    assert_refused(run_cli("compare", oracle), "one run; give another, or --same-questions")


def test_runs_without_a_shared_unit_and_folders_without_a_run_are_refused(
    make_nieh_set, tmp_path, run_cli, evaluate
):
    data = make_nieh_set(size=56)
    folders = [evaluate(tasks=task, data=data) for task in ("nieh_gt", "nieh_full")]
    assert_refused(run_cli("compare", *folders), "share no unit of the same task")
    assert_refused(
        run_cli("compare", tmp_path, folders[0]),
        f"{tmp_path}: no journal in it; give the folder of a run",
    )


def test_a_run_of_an_earlier_version_is_refused_in_one_line(
    make_nieh_set, tmp_path, run_cli, evaluate
):
    ours, old = evaluate(data=make_nieh_set(size=56)), tmp_path / "old"
    old.mkdir()
    (old / "journal.jsonl").write_text(
        json.dumps({"format": 1, "identity": {"model": {"name": "oracle"}}}) + "\n"
    )
    for folders in ((old, ours), (ours, old)):
        assert_refused(
            run_cli("compare", *folders),
            f"{old}: its journal is of format 1, this version reads 3; run the evaluation again",
        )


def test_rewards_are_points_and_shares_are_percent(tmp_path, run_cli):
    """Mean rewards of 4.4 and 2.2, of which every plan or none is a success."""
    steps = (StepRecord(),)
    records = [
        make_plan_record(name, index, (index, index + 1), 4.4)
        for name in "ab"
        for index in range(2)
    ]
    better = [
        replace(it, payload=replace(it.payload, steps=steps, max_reward=4.4)) for it in records
    ]
    worse = [
        replace(it, payload=replace(it.payload, reward=2.2, ended="step limit")) for it in better
    ]
    folders = [
        write_run(make_plans_run(label, of_run), tmp_path)
        for label, of_run in (("w", worse), ("b", better))
    ]
    code, out, err = run_cli("compare", *folders)
    assert (code, err) == (0, "")
    rows = read_rows(out)
    assert any(row.startswith("infthor_plans success % 0.00 100.00 +100.00 ") for row in rows)
    assert "infthor_plans reward points 2.20 4.40 +2.20 [+2.20, +2.20] < 0.0001 4 0" in rows


def test_runs_of_one_name_are_told_apart_by_the_options_that_differ(
    make_nieh_set, run_cli, evaluate
):
    data = make_nieh_set(size=56)
    folders = [evaluate("random", data=data, seed=seed) for seed in (0, 1)]
    out, _ = read_success(run_cli("compare", *folders))
    assert "random (seed=1) against random (seed=0)" in " ".join(out.split())
    assert "first: random (seed=0); second: random (seed=1)" in " ".join(out.split())


def test_blank_frames_are_part_of_the_name(make_nieh_set, run_cli, evaluate):
    data = make_nieh_set(size=56)
    folders = [evaluate(data=data, frames=frames) for frames in ("shown", "blank")]
    assert "oracle, blank frames against oracle" in run_cli("compare", *folders)[1]


def test_runs_of_other_tasks_are_compared_on_the_questions_that_they_share(
    make_nieh_set, run_cli, evaluate
):
    data = make_nieh_set(size=56)
    folders = [evaluate(tasks=task, data=data) for task in ("nieh_gt", "nieh_full")]
    blind = evaluate("blind", "nieh_full", data=data)
    code, out, _ = run_cli("compare", *folders, blind, "--same-questions")
    rows = [line.split() for line in out.splitlines() if " strict " in line and "guess" not in line]
    assert (code, len(rows)) == (0, 3)
    assert all(row[-2:] == ["5", "0"] for row in rows)
    code, out, _ = run_cli("compare", *folders, "--against", blind, "--same-questions")
    rows = [line for line in out.splitlines() if " strict " in line and "guess" not in line]
    assert (code, len(rows)) == (0, 2)
    assert all("blind, nieh_full" in row and "oracle, nieh_" in row for row in rows)
    # An interval of a difference of shares stays among them.
    ends = [float(end) for end in re.findall(r"[+-]\d+\.\d+", " ".join(rows))]
    assert ends and max(map(abs, ends)) <= 100


def test_questions_of_other_words_are_not_the_same(make_nieh_set, run_cli, evaluate):
    others = [dataclasses.replace(it, text=f"{it.text} Now?") for it in QUESTIONS]
    folders = [
        evaluate(data=make_nieh_set(questions, size=56, name=name))
        for name, questions in (("one", QUESTIONS), ("two", others))
    ]
    assert_refused(run_cli("compare", *folders, "--same-questions"), "share no question")
