"""Runs of plans that are killed, and simulators that die under them: nothing that counts
changes."""

import json
import os
import random
import signal
import time
from pathlib import Path

import pytest

from infthor_eval.errors import SimulatorError
from infthor_eval.plans.environment import PlanEnvironment
from infthor_eval.plans.records import RECORDS
from infthor_eval.runs import execute, read_run

from ..episodes.interrupted import drop_times
from ..helpers.processes import finish, start_cli
from ..helpers.trajectories import FORK, MUG, cut_trajectory, write_trajectories
from ..helpers.waiting import wait_until


def read_results(output):
    (folder,) = (path.parent for path in output.rglob("journal"))
    results = json.loads((folder / "results.json").read_text())
    return drop_times(read_run(folder, RECORDS)[1]), results["summary"]


def start(data, output, *more):
    return start_cli(
        *("run", "--model", "random", "--tasks", "infthor_plans"),
        *("--data", data, "--out", output, *more),
    )


def n_lines(output):
    return sum(path.read_bytes().count(b"\n") for path in output.rglob("worker-0.jsonl"))


def wait_for(n, output, process):
    """Until so many lines are in the journal, or the process has ended."""
    wait_until(lambda: n_lines(output) >= n or process.poll() is not None)


def kill_and_go_on(data, output, n_kills, draw):
    """Kill runs at a random moment, each a bit further than the one before; then let one end.
    Returns the kills."""
    killed = 0
    for _ in range(n_kills):
        process = start(data, output)
        wait_for(n_lines(output) + draw.randint(1, 2), output, process)
        time.sleep(draw.uniform(0.0, 0.3))
        if process.poll() is None:
            os.kill(process.pid, signal.SIGKILL)
            killed += 1
        process.communicate()
    finish(start(data, output))
    return killed


def test_a_run_that_is_killed_again_and_again_ends_as_one_that_is_not(tmp_path):
    data = write_trajectories(tmp_path / "data", cut_trajectory(FORK, 4), cut_trajectory(MUG, 3))
    finish(start(data, tmp_path / "whole"))
    killed = kill_and_go_on(data, tmp_path / "killed", 4, random.Random(0))
    assert killed >= 2
    assert read_results(tmp_path / "killed") == read_results(tmp_path / "whole")
    assert len(read_results(tmp_path / "whole")[0]) == 7


def n_restarts(outcome):
    faults = [fault for record in outcome.records for fault in record.faults]
    assert all(fault.startswith("simulator started again: ") for fault in faults)
    return sum(int(fault.rpartition(" ")[2]) for fault in faults)


@pytest.mark.parametrize("model", ["planner", "random"])
def test_a_simulator_that_dies_in_mid_plan_changes_no_result_and_is_counted(
    prepare_run, tmp_path, simulator_calls, model
):
    whole = execute(prepare_run(model, output=tmp_path / "whole"))
    n_calls = simulator_calls.n["default"]
    simulator_calls.deadly_from_now(random.Random(3).sample(range(1, n_calls), 2))
    disturbed = execute(prepare_run(model, output=tmp_path / "disturbed"))
    assert drop_times(disturbed.records) == drop_times(whole.records)
    assert disturbed.summary.summary == whole.summary.summary
    assert (n_restarts(whole), n_restarts(disturbed), simulator_calls.killed) == (0, 2, 2)


def test_an_episode_survives_more_deaths_than_one_plan_may_have(
    prepare_run, tmp_path, simulator_calls
):
    whole = execute(prepare_run(output=tmp_path / "whole"))
    simulator_calls.deadly_from_now(range(10, 400, 28))
    disturbed = execute(prepare_run(output=tmp_path / "disturbed"))
    assert drop_times(disturbed.records) == drop_times(whole.records)
    assert n_restarts(disturbed) == simulator_calls.killed > 3


@pytest.mark.usefixtures("shared_simulators")
@pytest.mark.parametrize("n_failures", [1, 2, 3])
def test_a_plan_is_begun_anew_where_the_simulator_fails_for_good(
    prepare_run, tmp_path, monkeypatch, n_failures
):
    whole = execute(prepare_run(output=tmp_path / "whole"))
    step, failures = PlanEnvironment.step, []

    def failing(environment, action):
        if environment._plan.index == 2 and len(failures) < n_failures:
            failures.append(f"it hangs ({len(failures)})")
            raise SimulatorError(failures[-1])
        return step(environment, action)

    monkeypatch.setattr(PlanEnvironment, "step", failing)
    outcome = execute(prepare_run(output=tmp_path / "failing"))
    third = outcome.records[2]
    if n_failures < 3:
        assert third.faults == tuple(failures)
        assert drop_times(outcome.records) == drop_times(whole.records)
    else:
        assert third.failure == "it hangs (2)"
        assert [record.payload.done for record in outcome.records] == [True, True, False, True]
        assert third.payload.max_reward == whole.records[2].payload.max_reward


def test_no_simulator_outlives_a_run_that_is_killed(tmp_path):
    process = start(
        write_trajectories(tmp_path / "data", cut_trajectory(FORK, 4)), tmp_path / "out"
    )
    wait_for(2, tmp_path / "out", process)
    children = [
        int(pid)
        for pid in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    ]
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    assert children
    wait_until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in children))
