"""Runs that are killed, simulators that die under them, and episodes at the same time: no number
changes."""

import json
import os
import signal

import pytest

from infthor_eval.errors import SimulatorError
from infthor_eval.manipulation.actors import BASELINES
from infthor_eval.manipulation.environment import ArmEnvironment
from infthor_eval.manipulation.records import RECORDS
from infthor_eval.runs import execute, read_run
from model_adapters import Capabilities

from ..episodes.interrupted import drop_times
from ..helpers.processes import ChildCounter, find_children, finish, start_cli
from ..helpers.trajectories import CANDLE, MUG, cut_trajectory, write_trajectories
from ..helpers.waiting import wait_until

# -- the run is killed


def start(data, output):
    return start_cli(
        *("run", "--model", "random-arm", "--tasks", "manipulathor"),
        *("--data", data, "--out", output),
    )


def read_results(output):
    (folder,) = (path.parent for path in output.rglob("journal"))
    return read_run(folder, RECORDS)[1], json.loads((folder / "results.json").read_text())[
        "summary"
    ]


@pytest.mark.usefixtures("shared_simulators")
def test_a_run_that_is_killed_ends_as_one_that_is_not(prepare_run, tmp_path):
    data = write_trajectories(tmp_path / "two", cut_trajectory(CANDLE, 6), cut_trajectory(MUG))
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    execute(prepare_run("random-arm", data=data, output=whole))
    process = start(data, killed)
    wait_until(lambda: any(lines(killed)), process)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    done = len(list(lines(killed)))
    finish(start(data, killed))
    records, summary = read_results(killed)
    assert 1 <= done < len(records)
    assert drop_times(records) == drop_times(read_results(whole)[0])
    assert summary == read_results(whole)[1]
    assert len(list(lines(killed))) == len(records)  # what was done is not done again


def lines(output):
    """Episodes that are in the journal, whole."""
    for path in output.rglob("worker-*.jsonl"):
        for line in path.read_bytes().splitlines(keepends=True):
            if line.endswith(b"\n") and b'"type":"unit"' in line:
                yield line


# -- simulators die


@pytest.mark.parametrize("mode", ["arm", "default"])
def test_a_simulator_that_dies_in_mid_episode_changes_no_result_and_is_told(
    prepare_run, tmp_path, simulator_calls, mode
):
    whole = execute(prepare_run("random-arm", output=tmp_path / "whole"))
    n_calls = simulator_calls.n[mode]
    assert n_calls > 20
    simulator_calls.deadly = {(mode, n_calls + 2 * n_calls // 3)}
    disturbed = execute(prepare_run("random-arm", output=tmp_path / "disturbed"))
    assert simulator_calls.killed == 1
    assert drop_times(disturbed.records) == drop_times(whole.records)
    assert disturbed.summary.summary == whole.summary.summary
    assert [fault for record in whole.records for fault in record.faults] == []
    assert [fault for record in disturbed.records for fault in record.faults] == [
        "simulator started again: 1"
    ]


@pytest.mark.usefixtures("shared_simulators")
@pytest.mark.parametrize("n_failures", [2, 3])
def test_an_episode_is_begun_anew_where_the_simulator_fails_for_good(
    prepare_run, tmp_path, monkeypatch, n_failures
):
    whole = execute(prepare_run("random-arm", output=tmp_path / "whole"))
    step, failures = ArmEnvironment.step, []

    def failing(environment, action):
        if environment.episode.index == 9 and len(failures) < n_failures:
            failures.append(f"it hangs ({len(failures)})")
            raise SimulatorError(failures[-1])
        return step(environment, action)

    monkeypatch.setattr(ArmEnvironment, "step", failing)
    outcome = execute(prepare_run("random-arm", output=tmp_path / "failing"))
    (first,) = (record for record in outcome.records if record.payload.index == 9)
    if n_failures < 3:
        assert first.faults == tuple(failures)
        assert drop_times(outcome.records) == drop_times(whole.records)
    else:
        assert (first.failure, first.payload.ended) == ("it hangs (2)", "")
        assert [record for record in drop_times(outcome.records) if record.payload.index != 9] == [
            record for record in drop_times(whole.records) if record.payload.index != 9
        ]


# -- several at once


def test_two_trajectories_at_once_find_what_one_after_the_other_finds(
    prepare_run, tmp_path, monkeypatch, pool
):
    data = write_trajectories(tmp_path / "two", cut_trajectory(CANDLE), cut_trajectory(MUG))
    counting = ChildCounter()
    together = execute(prepare_run("random-arm", data=data, output=tmp_path / "together"), counting)
    assert 2 < counting.most <= 4  # an expert and an arm for each
    assert not find_children() - counting.before  # simulators end with their runs
    one_by_one = Capabilities(counts_tokens=False, token_ids=False)
    assert BASELINES["random-arm"](0).capabilities.max_in_flight == 2
    monkeypatch.setattr(BASELINES["random-arm"], "capabilities", one_by_one)
    monkeypatch.setattr("infthor_eval.episodes.evaluation.Simulators", pool.simulators_type())
    alone = execute(prepare_run("random-arm", data=data, output=tmp_path / "alone"))
    assert drop_times(together.records) == drop_times(alone.records)
    assert together.summary == alone.summary
    assert len(together.records) == 3
