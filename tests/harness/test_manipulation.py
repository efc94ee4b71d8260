"""Manipulation with lm-eval as the host: an episode is one request, which our policies alone can
answer."""

import json
import os
import subprocess
import sys

import pytest

from infthor_eval.manipulation.records import RECORDS
from infthor_eval.runs import read_run
from tests.harness.conftest import OURS, read_samples
from tests.helpers.command_line import option_words
from tests.helpers.journals import read_records
from tests.helpers.trajectories import MUG, cut_trajectory, write_trajectories

TINY = "openvla-tiny"


def lm_eval_words(folder, data, out, adapter, *more):
    return [
        *(
            "lm-eval",
            "run",
            "--model",
            "infthor",
            "--model_args",
            f"adapter={adapter}{','.join(('', *more))}",
        ),
        *(
            "--include_path",
            folder,
            "--tasks",
            "manipulathor_pickup",
            "--output_path",
            out,
            "--log_samples",
        ),
        *("--metadata", json.dumps({"data": str(data)})),
    ]


@pytest.fixture
def short(task_files):
    """Tasks whose episodes have three steps."""
    task = task_files / "manipulation" / "manipulathor_pickup.yaml"
    settings = "{kind: pickup, max_steps: 3, image_size: 64}"
    task.write_text(
        f"include: _manipulation.yaml\ntask: manipulathor_pickup\ndataset_kwargs: {settings}\n"
    )
    return task_files


def test_one_request_an_episode_and_what_our_own_run_finds(tmp_path, short, run_cli, start):
    data = write_trajectories(tmp_path / "data", cut_trajectory(MUG, 6))
    arguments = option_words(
        model=TINY, tasks="manipulathor_pickup", data=data, out=tmp_path / "ours"
    )
    code, _, err = run_cli(*arguments)
    assert code == 0, err
    records = read_records(tmp_path / "ours")
    assert len(records) > 1
    out, journal = tmp_path / "theirs", tmp_path / "journal"
    start(OURS, *lm_eval_words(short, data, out, TINY, f"journal={journal}"))
    (rows,) = read_samples(out).values()
    assert [row["doc"]["arm_episode"] for row in rows] == [record.id for record in records]
    for row, record in zip(rows, records, strict=True):
        assert row["success"] == float(record.payload.done)
        assert row["reward"] == record.payload.reward
        assert row["doc"]["instruction"] == record.payload.instruction
        assert json.loads(row["resps"][0][0])["ended"] == record.payload.ended
    _, theirs = read_run(journal / "manipulation", RECORDS)
    assert [record.payload for record in theirs] == [record.payload for record in records]


@pytest.mark.parametrize(
    ("adapter", "task", "expected"),
    [
        (
            "qwen2.5-vl-tiny",
            "manipulathor_pickup",
            "cannot be evaluated on manipulation, which needs a policy that drives an arm",
        ),
        (
            TINY,
            "nieh_mini_gt",
            "openvla-tiny cannot be evaluated on nieh, which needs a model that answers in words",
        ),
    ],
)
def test_what_a_model_cannot_do_is_refused_in_one_line(tmp_path, short, adapter, task, expected):
    data = write_trajectories(tmp_path / "data", cut_trajectory(MUG, 2))
    arguments = lm_eval_words(short, data, tmp_path / "out", adapter)
    arguments[arguments.index("manipulathor_pickup")] = task
    done = subprocess.run(
        [sys.executable, "-c", OURS, *map(str, arguments), "--limit", "1"],
        env=os.environ | {"HF_HUB_OFFLINE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert expected in done.stderr.strip().splitlines()[-1]
