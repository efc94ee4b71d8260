"""Doing something again where the simulator failed for good; what it mends by itself is told
too."""

import os
import signal

import pytest

from infthor_eval.episodes.retries import with_retries
from infthor_eval.errors import SceneError, SimulatorError
from infthor_eval.storage.limits import ACTION_SECONDS
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator


@pytest.fixture(scope="module")
def simulator():
    with Simulator(embedded_launch(), image=False, instances=False) as simulator:
        simulator.reset("bedroom-1")
        yield simulator


def kill(simulator):
    process = simulator._controller.server.unity_proc
    os.kill(process.pid, signal.SIGKILL)
    process.wait()


def test_what_goes_well_is_done_once(simulator):
    anew = []
    result = with_retries(
        simulator, lambda: simulator.step("RotateLeft").success, lambda: anew.append(1)
    )
    assert result == (True, ())
    assert anew == []


def test_what_the_simulator_mends_by_itself_is_told(simulator):
    simulator.reset("bedroom-1")
    before = simulator.view.agent.rotation

    def turn():
        kill(simulator)
        return simulator.step("RotateLeft").agent.rotation

    anew = []
    result, faults = with_retries(simulator, turn, lambda: anew.append(1))
    assert result == (before - 90) % 360
    assert faults == ("simulator started again: 1",)
    assert anew == []


@pytest.mark.parametrize("n_failures", [1, 2, 3])
def test_a_failure_for_good_is_tried_again_twice(simulator, n_failures):
    anew, tried = [], []

    def fails():
        tried.append(len(anew))
        if len(tried) <= n_failures:
            raise SimulatorError(f"it hangs ({len(tried)})")
        return "made"

    if n_failures < 3:
        faults = tuple(f"it hangs ({number + 1})" for number in range(n_failures))
        assert with_retries(simulator, fails, lambda: anew.append(1)) == ("made", faults)
    else:
        with pytest.raises(SimulatorError, match=r"it hangs \(3\)"):
            with_retries(simulator, fails, lambda: anew.append(1))
    assert tried == list(range(min(n_failures + 1, 3)))  # each try begins anew
    assert len(anew) == n_failures


def test_a_scene_that_is_not_there_is_not_tried_again(simulator):
    tried = []

    def look():
        tried.append(1)
        return simulator.reset("FloorPlan999")

    with pytest.raises(SceneError, match="scene FloorPlan999"):
        with_retries(simulator, look, lambda: tried.append(2))
    assert tried == [1]


def test_other_errors_are_nobodys_to_mend(simulator):
    with pytest.raises(ZeroDivisionError):
        with_retries(simulator, lambda: 1 / 0, lambda: None)


def test_a_simulator_that_stops_answering_is_replaced_and_told(monkeypatch):
    monkeypatch.setenv(ACTION_SECONDS.name, "3")
    with Simulator(embedded_launch(), image=False, instances=False) as simulator:
        simulator.reset("bedroom-1")
        before = simulator.step("RotateRight").agent
        stopped = simulator._controller.server.unity_proc
        os.kill(stopped.pid, signal.SIGSTOP)
        agent, faults = with_retries(
            simulator, lambda: simulator.step("RotateLeft").agent, lambda: None
        )
        assert faults[0].startswith("simulator started again: ")
        assert stopped.poll() is not None
        assert (agent.position, agent.rotation) == (
            before.position,
            simulator.reset("bedroom-1").agent.rotation,
        )


def test_a_hang_that_stays_names_the_limit(monkeypatch):
    monkeypatch.setenv(ACTION_SECONDS.name, "1")
    with Simulator(embedded_launch(), image=False, instances=False, max_restarts=0) as simulator:
        simulator.reset("bedroom-1")
        os.kill(simulator._controller.server.unity_proc.pid, signal.SIGSTOP)
        with pytest.raises(
            SimulatorError, match=r"no answer within 1 s .* set INFTHOR_EVAL_MAX_ACTION_SECONDS"
        ):
            simulator.step("RotateLeft")
