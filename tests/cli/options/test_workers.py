"""Runs by several workers have the results of one process, byte by byte."""

import pytest

from tests.helpers.trajectories import FORK, MUG, cut_trajectory, write_trajectories

from ...helpers.command_line import read_success


def results(folder):
    (path,) = folder.rglob("results.json")
    return path.read_bytes()


def exported(folder):
    """What lm-eval's files have of each sample."""
    return {
        path.name.rpartition("_")[0]: path.read_bytes() for path in folder.rglob("samples_*.jsonl")
    }


@pytest.mark.parametrize(
    ("model", "task"),
    [
        ("qwen2.5-vl-tiny", "nieh_gt"),
        ("planner", "infthor_plans"),
        ("planner-arm", "manipulathor_pickup"),
    ],
)
def test_two_workers_have_the_results_of_one_process(run_cli, make_nieh_set, tmp_path, model, task):
    data = (
        make_nieh_set(size=56)
        if task == "nieh_gt"
        else write_trajectories(tmp_path / "data", cut_trajectory(FORK, 3), cut_trajectory(MUG, 4))
    )
    words = ("--model", model, "--tasks", task, "--data", data)
    for workers in (1, 2):
        more = ("--out", tmp_path / str(workers), "--workers", workers)
        output, _ = read_success(run_cli(*words, *more))
        assert model in output
    one, two = tmp_path / "1", tmp_path / "2"
    assert results(one) == results(two)
    assert exported(one) == exported(two)
    assert exported(one)
    shards = [
        path for path in two.rglob("journal/worker-*.jsonl") if path.read_bytes().count(b"\n") > 1
    ]
    assert {path.name for path in shards} <= {"worker-1.jsonl", "worker-2.jsonl"}
    assert shards
