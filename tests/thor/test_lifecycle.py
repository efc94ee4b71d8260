"""The embedded simulator through the wrapper: what users start and stop."""

import gc
import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import numpy as np
import pytest

from infthor_eval.errors import SimulatorError
from infthor_eval.thor.launch import Launch, embedded_launch
from infthor_eval.thor.simulator import Simulator

from ..helpers.processes import find_children
from ..helpers.waiting import PATIENCE_S
from .test_simulator import open_files, scripted

SCENE = "kitchen-3"


def test_an_episode_survives_the_death_of_its_simulator():
    actions = ["MoveAhead", "RotateRight", "MoveAhead", "LookDown", "RotateLeft", "MoveAhead"]
    frames = []
    for deadly in (None, 3):
        with Simulator(embedded_launch()) as simulator:
            simulator.reset(SCENE)
            for index, action in enumerate(actions):
                if index == deadly:
                    os.kill(simulator._controller.unity_pid, 9)
                view = simulator.step(action)
            assert simulator.restarts == (deadly is not None)
            frames.append((view.agent, view.frame))
    assert frames[0][0] == frames[1][0]
    assert np.array_equal(frames[0][1], frames[1][1])


def test_a_query_is_no_part_of_the_episode(simulator):
    before = simulator.reset(SCENE)
    assert simulator.query("GetReachablePositions").result
    assert simulator.view is before
    assert simulator.mark().episode == ()


@pytest.mark.parametrize(
    "actions", [["MoveAhead", "RotateRight", "LookDown"], ["RotateLeft", "Crouch", "MoveAhead"]]
)
def test_rewinding_brings_the_world_back(actions, simulator):
    simulator.reset(SCENE)
    there = simulator.step("RotateRight")
    mark = simulator.mark()
    for action in actions:
        simulator.step(action)
    back = simulator.rewind(mark)
    assert back.agent == there.agent
    after = [simulator.step("MoveAhead"), simulator.step("RotateRight")]
    simulator.rewind(mark)
    again = [simulator.step("MoveAhead"), simulator.step("RotateRight")]
    assert all(one.agent == other.agent for one, other in zip(after, again, strict=True))
    # Walking adds rounding errors that a teleport does not: single pixels at edges may differ.
    assert all(
        np.mean(one.frame != other.frame) < 1e-3 for one, other in zip(after, again, strict=True)
    )


def test_the_last_two_marks_are_gone_back_to_without_repeating_the_episode(monkeypatch, simulator):
    simulator.reset(SCENE)
    monkeypatch.setattr(simulator, "reset", lambda _: pytest.fail("the episode was repeated"))
    marks, views = [], []
    for action in ("Crouch", "RotateRight"):
        simulator.step(action)
        views.append(simulator.step("MoveAhead"))
        marks.append(simulator.mark())
    simulator.step("Stand")
    for mark, view in reversed(list(zip(marks, views, strict=True))):
        simulator.rewind(mark)
        again = simulator.query("Pass")
        assert again.agent == view.agent
        assert np.array_equal(again.frame, view.frame)
        simulator.step("RotateLeft")
    assert simulator.rewind(marks[0]).agent == views[0].agent


def test_nothing_is_drawn_to_rewind():
    with Simulator(embedded_launch(), depth=True) as simulator:
        simulator.reset(SCENE)
        mark = simulator.mark()
        simulator.step("RotateRight")
        simulator.rewind(mark, exactly=True)
        event = simulator._controller.last_event
        assert event.metadata["lastAction"] == "RestoreState"
        assert event.frame is event.depth_frame is event.instance_segmentation_frame is None


@pytest.mark.parametrize("exactly", [False, True])
def test_any_mark_of_the_scene_can_be_gone_to_from_any_moment(exactly):
    with Simulator(embedded_launch(), max_copies=8) as simulator:
        simulator.reset(SCENE)
        marks = []
        for action in ("RotateRight", "MoveAhead", "Crouch", "RotateRight", "MoveAhead"):
            simulator.step(action)
            marks.append(simulator.mark())
        calls = []
        step = simulator._controller.step
        simulator._controller.step = lambda *args, **kwargs: (
            calls.append(args) or step(*args, **kwargs)
        )
        for number in (0, 4, 2, 3, 1, 4):
            view = simulator.rewind(marks[number], exactly=exactly)
            assert view is marks[number].view
            again = simulator.query("Pass")
            assert again.agent == view.agent
            assert np.array_equal(again.frame, view.frame)
            simulator.step("Stand")
            simulator.step("RotateLeft")
        assert len(calls) == 6 * 4  # none of them goes the way again


def test_without_copies_the_way_is_gone_again():
    with Simulator(embedded_launch(), max_copies=1) as simulator:
        simulator.reset(SCENE)
        marks = []
        for action in ("RotateRight", "MoveAhead", "Crouch"):
            simulator.step(action)
            marks.append(simulator.mark())
        simulator.step("RotateLeft")
        for mark in (marks[1], marks[0], marks[2]):
            view = simulator.rewind(mark, exactly=True)
            assert view.agent == mark.view.agent
            assert np.array_equal(view.frame, mark.view.frame)


@pytest.mark.parametrize("scene", ["FloorPlan9999", "nowhere"])
def test_an_unknown_scene_is_one_line(simulator, scene):
    with pytest.raises(SimulatorError, match=scene) as caught:
        simulator.reset(scene)
    assert "\n" not in str(caught.value)


def test_an_executable_that_is_not_there():
    with (
        Simulator(Launch("/nowhere/simulator")) as simulator,
        pytest.raises(SimulatorError, match="nowhere"),
    ):
        simulator.reset(SCENE)


def test_two_hundred_starts_and_stops_leave_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def cycle():
        with Simulator(scripted(tmp_path)) as simulator:
            simulator.reset(SCENE)
            simulator.step("MoveAhead")

    cycle()
    gc.collect()
    before = find_children(), open_files(), threading.active_count()
    memory = resident()
    for _ in range(200):
        cycle()
    gc.collect()
    assert (find_children(), open_files(), threading.active_count()) == before
    assert [path.name for path in tmp_path.iterdir()] == []
    assert resident() - memory < 20


def resident():
    """Resident memory of this process, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def test_the_pipes_of_a_killed_process_go_with_the_next_one(tmp_path):
    code = (
        "import os, signal, sys\n"
        "from infthor_eval.thor.transport import SafeFifoServer\n"
        "server = SafeFifoServer(300, 300)\n"
        "server.start()\n"
        "if sys.argv[1:]: os.kill(os.getpid(), signal.SIGKILL)\n"
        "server.stop()\n"
    )
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    command = [sys.executable, "-c", code]
    subprocess.run([*command, "die"], env=environment, check=False, timeout=PATIENCE_S)
    assert list(tmp_path.rglob("*.pipe"))
    subprocess.run(command, env=environment, check=True, timeout=PATIENCE_S)
    assert list(tmp_path.iterdir()) == []
