"""Plans with lm-eval as the host: an episode is one request, which our models alone can answer."""

import json
import os
import subprocess
import sys

import pytest

from infthor_eval.plans.records import RECORDS
from infthor_eval.runs import read_run
from infthor_eval.storage.folders import packaged_folder
from tests.harness.conftest import LM_EVAL, read_samples
from tests.helpers.command_line import option_words
from tests.helpers.files import find_one
from tests.helpers.journals import read_records
from tests.helpers.trajectories import FORK, MUG, cut_trajectory, write_trajectories

PACKAGED = packaged_folder("tasks") / "plans" / "infthor_plans.yaml"
TINY = "qwen2.5-vl-tiny"


def lm_eval_words(task, data, out, model, *more, **options):
    metadata = json.dumps({"data": str(data), **options})
    return ["run", *model, "--tasks", task, "--metadata", metadata, "--output_path", out, *more]


def test_one_request_a_trajectory_and_what_our_own_run_finds(tmp_path, task_files, run_cli, start):
    task = task_files / "plans" / "infthor_plans.yaml"
    task.write_text(
        "include: _plans.yaml\ntask: infthor_plans\ndataset_kwargs: {plans: all, max_steps: 3}\n"
    )
    data = write_trajectories(tmp_path / "data", cut_trajectory(FORK, 3), cut_trajectory(MUG, 2))
    arguments = option_words(model=TINY, tasks="infthor_plans", data=data, out=tmp_path / "ours")
    code, _, err = run_cli(*arguments, "--greedy", "--constrained")
    assert code == 0, err
    records = read_records(tmp_path / "ours")
    expected = {}
    for record in records:
        expected.setdefault(record.cluster, []).append(record.payload)
    out, journal = tmp_path / "theirs", tmp_path / "journal"
    model = ["--model", "infthor", "--model_args", f"adapter={TINY},journal={journal}"]
    start(
        LM_EVAL,
        *lm_eval_words(task, data, out, model, "--log_samples", greedy=True, constrained=True),
    )
    (rows,) = read_samples(out).values()
    assert [row["doc"]["traj_id"] for row in rows] == [MUG, FORK]
    assert {row["doc"]["traj_id"]: row["doc"]["plans"] for row in rows} == {
        name: [plan.plan for plan in plans] for name, plans in expected.items()
    }
    for row in rows:
        plans = expected[row["doc"]["traj_id"]]
        assert row["success"] == sum(plan.done for plan in plans) / len(plans)
        assert row["reward"] == pytest.approx(sum(plan.reward for plan in plans))
        assert row["target"] == f"{len(plans)} plans done"
        assert [plan["ended"] for plan in json.loads(row["resps"][0][0])] == [
            plan.ended for plan in plans
        ]
    results = json.loads(find_one(out, "results_*.json").read_text())["results"]["infthor_plans"]
    assert results["reward,none"] == pytest.approx(sum(row["reward"] for row in rows) / 2)
    # What it did is in the journal, as in ours.
    _, theirs = read_run(journal / "plans", RECORDS)
    assert [record.payload for record in theirs] == [record.payload for record in records]


def test_another_model_of_lm_evals_is_refused_in_one_line(tmp_path):
    data = write_trajectories(tmp_path / "data", cut_trajectory(FORK, 1))
    arguments = lm_eval_words(PACKAGED, data, tmp_path / "out", ["--model", "dummy"])
    done = subprocess.run(
        [sys.executable, "-c", LM_EVAL, *map(str, arguments)],
        env=os.environ | {"HF_HUB_OFFLINE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    assert done.stderr.strip().splitlines()[-1] == (
        "infthor-eval: plans are carried out in a simulator, which infthor-eval's models alone do; "
        "use --model infthor"
    )
