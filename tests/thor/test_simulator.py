import gc
import shlex
import sys
import threading
from pathlib import Path

import pytest

from infthor_eval.errors import SimulatorError
from infthor_eval.thor.launch import Launch, embedded_launch
from infthor_eval.thor.simulator import Simulator

from ..helpers.processes import find_children
from ..helpers.waiting import PATIENCE_S

PEER = Path(__file__).with_name("scripted_peer.py")


def scripted(tmp_path, fault="none", action="-", number=1):
    words = [sys.executable, str(PEER), fault, action, str(number), str(tmp_path / "marker")]
    # One second where a peer falls silent, as that is waited for; else time enough for a busy
    # machine.
    return Launch(
        shlex.join(words),
        timeout=1.0 if fault.rstrip("!") in ("hang", "close") else PATIENCE_S,
        start_timeout=PATIENCE_S,
    )


def open_files():
    return len(list(Path("/proc/self/fd").iterdir()))


@pytest.fixture(autouse=True)
def nothing_left_behind(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    gc.collect()  # of what earlier tests left open
    before = find_children(), open_files(), threading.active_count()
    yield
    gc.collect()
    assert (find_children(), open_files(), threading.active_count()) == before
    assert not (tmp_path / "home/.ai2thor").exists()


def test_steps_give_views(tmp_path):
    with Simulator(scripted(tmp_path)) as simulator:
        simulator.reset("kitchen-1")
        view = simulator.step("MoveAhead")
        assert view.success and view.agent.position.x == 1
        assert view.frame.shape == (300, 300, 3) and view.frame.flags["C_CONTIGUOUS"]
        assert simulator.view is view


@pytest.mark.parametrize(
    ("action", "message"), [("Refused", "no room"), ("Unknown", "Invalid action")]
)
def test_a_refusal_is_a_view(tmp_path, action, message):
    with Simulator(scripted(tmp_path)) as simulator:
        simulator.reset("kitchen-1")
        view = simulator.step(action)
        assert not view.success and message in view.error


GARBAGE = ["type", "length", "msgpack", "empty", "fields", "sequence"]


@pytest.mark.parametrize("fault", ["die", "hang", "close", *GARBAGE])
def test_a_fault_in_mid_action_is_survived(tmp_path, fault):
    with Simulator(scripted(tmp_path, fault, "MoveAhead", 3)) as simulator:
        simulator.reset("kitchen-1")
        positions = [simulator.step("MoveAhead").agent.position.x for _ in range(4)]
        simulator.step("Refused")
        assert positions == [1, 2, 3, 4]
        assert simulator.restarts == 1


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("die!", r"died \(exit status 3\).*last words"),
        ("hang!", "no answer within 1 s"),
        ("type!", "protocol"),
    ],
)
def test_a_fault_that_stays_is_told(tmp_path, fault, words):
    with Simulator(scripted(tmp_path, fault, "MoveAhead", 2), max_restarts=1) as simulator:
        simulator.reset("kitchen-1")
        simulator.step("MoveAhead")
        with pytest.raises(SimulatorError, match=f"(?s){words}.*giving up") as caught:
            simulator.step("MoveAhead")
    assert "\n" not in str(caught.value)
    assert "MoveAhead" in str(caught.value)


def test_an_episode_may_survive_as_many_failures_from_each_mark_on(tmp_path):
    with Simulator(scripted(tmp_path, "die!", "Deadly", 1), max_restarts=2) as simulator:
        simulator.reset("kitchen-1")
        for n_steps in range(1, 5):
            with pytest.raises(SimulatorError, match="failure 3 since the last mark, giving up"):
                simulator.step("Deadly")
            assert simulator.step("MoveAhead").agent.position.x == n_steps
            simulator.mark()
        assert simulator.restarts == 8
        with pytest.raises(SimulatorError, match="giving up"):
            simulator.step("Deadly")
        with pytest.raises(SimulatorError, match="failure 4"):  # no mark, no new chance
            simulator.step("Deadly")


def test_what_is_repeated_to_come_to_a_mark_is_kept_for_the_next_time():
    with Simulator(embedded_launch(), instances=False, image=False) as simulator:
        simulator.reset("kitchen-2")
        simulator.step("RotateRight")
        mark = simulator.mark()
        simulator.step("RotateRight")
        simulator.close()  # with it goes the process's copy
        assert simulator.rewind(mark, exactly=True).agent == mark.view.agent
        simulator.step("RotateRight")
        calls, step = [], simulator.step
        simulator.step = lambda action, **arguments: (
            calls.append(action) or step(action, **arguments)
        )
        assert simulator.rewind(mark, exactly=True).agent == mark.view.agent
        assert calls == ["RestoreState"]


@pytest.mark.parametrize("fault", ["die!", "hang!"])
def test_a_simulator_that_never_starts(tmp_path, fault):
    launch = Launch(
        scripted(tmp_path, fault, "handshake").executable, timeout=1.0, start_timeout=1.0
    )
    with (
        Simulator(launch, max_restarts=1) as simulator,
        pytest.raises(SimulatorError, match="at starting"),
    ):
        simulator.reset("kitchen-1")


def test_one_that_dies_before_the_handshake_once(tmp_path):
    with Simulator(scripted(tmp_path, "die", "handshake")) as simulator:
        simulator.reset("kitchen-1")
        assert simulator.restarts == 1


def test_no_scene_yet(tmp_path):
    with Simulator(scripted(tmp_path)) as simulator:
        with pytest.raises(SimulatorError, match="no scene is loaded"):
            simulator.step("MoveAhead")
        with pytest.raises(SimulatorError, match="no scene is loaded"):
            _ = simulator.view
