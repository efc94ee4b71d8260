"""Runs that are killed, simulators that die under them, and episodes at the same time: no number
changes."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from infthor_eval.errors import SimulatorError
from infthor_eval.manipulation.actors import BASELINES
from infthor_eval.manipulation.environment import ArmEnvironment
from infthor_eval.manipulation.records import RECORDS
from infthor_eval.runs import Silent, execute, read_run
from infthor_eval.thor.controller import SafeController
from model_adapters import Capabilities

from ..plans.cut import CANDLE, MUG, cut, write
from ..waiting import PATIENCE_S, wait_until

OURS = "from infthor_eval.cli import main; main()"


def same(records):
    """What is to be equal in two runs: all but times, attempts and faults."""
    return [
        msgspec.structs.replace(record, seconds=0.0, attempt=1, faults=()) for record in records
    ]


# -- the run is killed


def start(data, output):
    words = [
        "run",
        "--model",
        "random-arm",
        "--tasks",
        "manipulathor",
        "--data",
        data,
        "--output",
        output,
    ]
    return subprocess.Popen(
        [sys.executable, "-c", OURS, *map(str, words)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )


def finish(process):
    _, said = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, said


def found(output):
    (folder,) = (path.parent for path in output.rglob("journal"))
    return read_run(folder, RECORDS)[1], json.loads((folder / "results.json").read_text())[
        "summary"
    ]


@pytest.mark.usefixtures("shared_simulators")
def test_a_run_that_is_killed_ends_as_one_that_is_not(prepared, tmp_path):
    data = write(tmp_path / "two", cut(CANDLE, 6), cut(MUG))
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    execute(prepared("random-arm", data=data, output=whole))
    process = start(data, killed)
    wait_until(lambda: any(lines(killed)), process)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    done = len(list(lines(killed)))
    finish(start(data, killed))
    records, summary = found(killed)
    assert 1 <= done < len(records)
    assert same(records) == same(found(whole)[0])
    assert summary == found(whole)[1]
    assert len(list(lines(killed))) == len(records)  # what was done is not done again


def lines(output):
    """Episodes that are in the journal, whole."""
    for path in output.rglob("worker-*.jsonl"):
        for line in path.read_bytes().splitlines(keepends=True):
            if line.endswith(b"\n") and b'"type":"unit"' in line:
                yield line


# -- simulators die


class Calls:
    """Calls of simulators in this process: counted by agent mode, and processes killed before some
    of them."""

    def __init__(self):
        self.n = {"arm": 0, "default": 0}
        self.deadly = set()
        self.killed = 0

    def come(self, controller):
        process = controller.server and controller.server.unity_proc
        if controller.last_event is None or process is None:
            return  # at starting
        mode = "arm" if controller.last_event.metadata.get("arm") else "default"
        self.n[mode] += 1
        if (mode, self.n[mode]) in self.deadly:
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
            self.killed += 1


@pytest.fixture
def calls(monkeypatch, shared_simulators):
    found, step = Calls(), SafeController.step

    def counted(controller, action=None, **arguments):
        found.come(controller)
        return step(controller, action, **arguments)

    monkeypatch.setattr(SafeController, "step", counted)
    return found


@pytest.mark.parametrize("mode", ["arm", "default"])
def test_a_simulator_that_dies_in_mid_episode_changes_no_result_and_is_told(
    prepared, tmp_path, calls, mode
):
    whole = execute(prepared("random-arm", output=tmp_path / "whole"))
    n_calls = calls.n[mode]
    assert n_calls > 20
    calls.deadly = {(mode, n_calls + 2 * n_calls // 3)}
    disturbed = execute(prepared("random-arm", output=tmp_path / "disturbed"))
    assert calls.killed == 1
    assert same(disturbed.records) == same(whole.records)
    assert disturbed.summary.summary == whole.summary.summary
    assert [fault for record in whole.records for fault in record.faults] == []
    assert [fault for record in disturbed.records for fault in record.faults] == [
        "simulator started again: 1"
    ]


@pytest.mark.usefixtures("shared_simulators")
@pytest.mark.parametrize("n_failures", [2, 3])
def test_an_episode_is_begun_anew_where_the_simulator_fails_for_good(
    prepared, tmp_path, monkeypatch, n_failures
):
    whole = execute(prepared("random-arm", output=tmp_path / "whole"))
    step, failures = ArmEnvironment.step, []

    def failing(environment, action):
        if environment.episode.index == 9 and len(failures) < n_failures:
            failures.append(f"it hangs ({len(failures)})")
            raise SimulatorError(failures[-1])
        return step(environment, action)

    monkeypatch.setattr(ArmEnvironment, "step", failing)
    outcome = execute(prepared("random-arm", output=tmp_path / "failing"))
    (first,) = (record for record in outcome.records if record.payload.index == 9)
    if n_failures < 3:
        assert first.faults == tuple(failures)
        assert same(outcome.records) == same(whole.records)
    else:
        assert (first.failure, first.payload.ended) == ("it hangs (2)", "")
        assert [record for record in same(outcome.records) if record.payload.index != 9] == [
            record for record in same(whole.records) if record.payload.index != 9
        ]


# -- several at once


def children():
    return {
        child
        for task in Path("/proc/self/task").iterdir()
        for child in (task / "children").read_text().split()
    }


class Counting(Silent):
    """Counts the processes whenever an episode is done."""

    def __init__(self):
        self.before, self.most = children(), 0

    def done(self, record, resumed):
        self.most = max(self.most, len(children() - self.before))


def test_two_trajectories_at_once_find_what_one_after_the_other_finds(
    prepared, tmp_path, monkeypatch, pool
):
    data = write(tmp_path / "two", cut(CANDLE), cut(MUG))
    counting = Counting()
    together = execute(prepared("random-arm", data=data, output=tmp_path / "together"), counting)
    assert 2 < counting.most <= 4  # an expert and an arm for each
    assert not children() - counting.before  # simulators end with their runs
    one_by_one = Capabilities(counts_tokens=False, token_ids=False)
    assert BASELINES["random-arm"](0).capabilities.max_in_flight == 2
    monkeypatch.setattr(BASELINES["random-arm"], "capabilities", one_by_one)
    monkeypatch.setattr("infthor_eval.episodes.evaluation.Simulators", pool.simulators_type())
    alone = execute(prepared("random-arm", data=data, output=tmp_path / "alone"))
    assert same(together.records) == same(alone.records)
    assert together.summary == alone.summary
    assert len(together.records) == 3
