"""Runs of plans that are killed, and simulators that die under them: nothing that counts changes."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import pytest

from infthor_eval.agents.records import RECORDS
from infthor_eval.runs import execute, read_run
from infthor_eval.thor.controller import SafeController

from .cut import FORK, MUG, cut, write

OURS = "from infthor_eval.cli import main; main()"


def same(records):
    """What is to be equal in two runs: all but times, attempts and faults."""
    return [msgspec.structs.replace(record, seconds=0.0, attempt=1, faults=()) for record in records]


def found(output):
    (folder,) = (path.parent for path in output.rglob("journal"))
    return same(read_run(folder, RECORDS)[1]), json.loads((folder / "results.json").read_text())["summary"]


def start(data, output, *more):
    arguments = ["run", "--model", "random", "--tasks", "infthor_plans", "--data", data, "--output", output, *more]
    return subprocess.Popen(
        [sys.executable, "-c", OURS, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )


def n_lines(output):
    return sum(path.read_bytes().count(b"\n") for path in output.rglob("worker-0.jsonl"))


def finish(process):
    _, said = process.communicate(timeout=120)
    assert process.returncode == 0, said


def wait_for(n, output, process):
    """Until so many lines are in the journal, or the process has ended."""
    deadline = time.monotonic() + 120
    while n_lines(output) < n and process.poll() is None:
        assert time.monotonic() < deadline
        time.sleep(0.005)


def kill_and_go_on(data, output, n_kills, draw):
    """Kill runs at a random moment, each a bit further than the one before; then let one end. Returns the kills."""
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


@pytest.mark.timeout(300)
def test_a_run_that_is_killed_again_and_again_ends_as_one_that_is_not(tmp_path):
    data = write(tmp_path / "data", cut(FORK, 6), cut(MUG, 5))
    finish(start(data, tmp_path / "whole"))
    killed = kill_and_go_on(data, tmp_path / "killed", 4, random.Random(0))
    assert killed >= 2
    assert found(tmp_path / "killed") == found(tmp_path / "whole")
    assert len(found(tmp_path / "whole")[0]) == 11


@pytest.fixture
def killing(monkeypatch):
    """Kills the simulator's process before some of its calls, counted from now on."""
    step = SafeController.step

    def kill_before(numbers):
        calls = iter(range(1_000_000))

        def dying_step(controller, action=None, **arguments):
            process = controller.server and controller.server.unity_proc
            if process is not None and controller.last_event is not None and next(calls) in numbers:
                os.kill(process.pid, signal.SIGKILL)
                process.wait()
            return step(controller, action, **arguments)

        monkeypatch.setattr(SafeController, "step", dying_step)

    return kill_before


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Records of planner and random on a kitchen's first tasks, and the number of calls that they take."""


@pytest.mark.usefixtures("shared_simulator")
@pytest.mark.parametrize("model", ["planner", "random"])
def test_a_simulator_that_dies_in_mid_plan_changes_no_result_and_is_counted(prepared, tmp_path, killing, model):
    whole = execute(prepared(model, output=tmp_path / "whole"))
    draw = random.Random(3)
    killing({draw.randrange(5, 60), draw.randrange(60, 120)})
    disturbed = execute(prepared(model, output=tmp_path / "disturbed"))
    assert same(disturbed.records) == same(whole.records)
    assert disturbed.summary.summary == whole.summary.summary
    faults = [fault for record in disturbed.records for fault in record.faults]
    assert faults
    assert sum(int(fault.rpartition(" ")[2]) for fault in faults) == 2
    assert not any(record.faults for record in whole.records)


@pytest.mark.usefixtures("shared_simulator")
def test_an_episode_survives_more_deaths_than_one_plan_may_have(prepared, tmp_path, killing):
    whole = execute(prepared(output=tmp_path / "whole"))
    killing(set(range(12, 400, 28)))
    disturbed = execute(prepared(output=tmp_path / "disturbed"))
    assert same(disturbed.records) == same(whole.records)
    assert sum(len(record.faults) for record in disturbed.records) >= 3


@pytest.mark.usefixtures("shared_simulator")
def test_a_simulator_that_never_lives_long_fails_the_plans_and_says_so(prepared, killing, tmp_path):
    killing(range(1, 1_000_000, 2))
    outcome = execute(prepared(output=tmp_path / "dying", limit=1))
    assert all("giving up" in record.failure for record in outcome.records)
    assert outcome.summary.summary.tasks["infthor_plans"].n_failed == 4
