"""The process by itself: it says what is wrong in one line, and never outlives its controller."""

import os
import struct
import subprocess
import sys
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import pytest

from ..helpers.waiting import PATIENCE_S, wait_until

COMMAND = [sys.executable, "-m", "infthor_sim.player"]


@pytest.fixture
def pipes(tmp_path: Path) -> Iterator[dict[str, str]]:
    names = {}
    for side in ("SERVER", "CLIENT"):
        path = tmp_path / f"{side.lower()}.pipe"
        os.mkfifo(path)
        names[f"AI2THOR_FIFO_{side}_PIPE_PATH"] = str(path)
    yield names


def first_state(states: BinaryIO) -> list[int]:
    """Reads one message; the types of its frames."""
    field_types = []
    while not field_types or field_types[-1] != 255:
        field_type, length = struct.unpack("!BI", states.read(5))
        assert len(states.read(length)) == length
        field_types.append(field_type)
    return field_types


def test_started_by_hand_it_explains_itself():
    environment = {k: v for k, v in os.environ.items() if not k.startswith("AI2THOR")}
    done = subprocess.run(
        COMMAND, env=environment, capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "Controller" in done.stderr


def test_garbage_instead_of_an_action(pipes):
    process = subprocess.Popen(COMMAND, env=os.environ | pipes, stderr=subprocess.PIPE, text=True)
    with Path(pipes["AI2THOR_FIFO_SERVER_PIPE_PATH"]).open("rb") as states:
        assert first_state(states) == [1, 4, 255]
        with Path(pipes["AI2THOR_FIFO_CLIENT_PIPE_PATH"]).open("wb") as actions:
            actions.write(struct.pack("!BI", 2, 3) + b"{]}" + struct.pack("!BI", 255, 0))
        while states.read(65536):
            pass
    _, printed = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    assert "not JSON" in printed
    assert "Traceback" not in printed


def test_it_goes_when_the_controller_hangs_up(pipes):
    process = subprocess.Popen(COMMAND, env=os.environ | pipes)
    with Path(pipes["AI2THOR_FIFO_SERVER_PIPE_PATH"]).open("rb") as states:
        first_state(states)
        Path(pipes["AI2THOR_FIFO_CLIENT_PIPE_PATH"]).open("wb").close()
    assert process.wait(timeout=PATIENCE_S) == 0


def test_it_goes_when_its_parent_dies_before_the_handshake(pipes):
    script = (
        f"import subprocess,sys,time; p=subprocess.Popen({COMMAND!r}); print(p.pid, flush=True); "
        "time.sleep(60)"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c", script], env=os.environ | pipes, stdout=subprocess.PIPE, text=True
    )
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    status = Path(f"/proc/{child}/status")
    # it waits once it sleeps in so many looks in a row; while it imports it works
    looks = deque(maxlen=20)
    wait_until(
        lambda: looks.append("(sleeping)" in status.read_text()) or sum(looks) == looks.maxlen
    )
    parent.kill()
    parent.wait()
    parent.stdout.close()
    # it waits for no dead controller
    wait_until(lambda: not status.exists() or "(zombie)" in status.read_text())


def test_it_goes_when_its_controller_died_before_it_looked(pipes):
    # the number of a process that is not there any more, as if it had died during the imports
    with subprocess.Popen([sys.executable, "-c", ""]) as gone:
        pass
    done = subprocess.run(
        [*COMMAND, "--controller", str(gone.pid)],
        env=os.environ | pipes,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == 1
    assert "the controller died before it opened its pipe" in done.stderr


@pytest.mark.parametrize("start", ["ours", "ai2thor's"])
def test_a_controller_that_is_killed_at_once_leaves_no_simulator(start, tmp_path):
    pid = tmp_path / "pid"
    script = (
        "import os, pathlib, signal, subprocess\n"
        "popen = subprocess.Popen\n"
        "def start_and_die(*arguments, **options):\n"
        "    process = popen(*arguments, **options)\n"
        f"    pathlib.Path({str(pid)!r}).write_text(str(process.pid))\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    ) + {
        "ours": "from infthor_eval.thor.launch import embedded_launch\n"
        "from infthor_eval.thor.simulator import Simulator\n"
        "subprocess.Popen = start_and_die\n"
        "Simulator(embedded_launch()).reset('kitchen-1')\n",
        "ai2thor's": "from infthor_sim import Controller\n"
        "subprocess.Popen = start_and_die\n"
        "Controller()\n",
    }[start]
    died = subprocess.run([sys.executable, "-c", script], timeout=PATIENCE_S, check=False)
    assert died.returncode == -9
    status = Path("/proc", pid.read_text(), "status")
    wait_until(lambda: not status.exists() or "(zombie)" in status.read_text())
