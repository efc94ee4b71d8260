"""Simulators as forks of a process that has imported them, in place of new processes.

All else is as always: a process of its own, its pipes, its end. Only the two seconds are saved in
which Python starts and imports the simulator, thousands of times.
"""

import os
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import IO

import ai2thor.controller

from infthor_sim.pictures.views import Display
from infthor_sim.player.__main__ import main
from infthor_sim.player.server import SimulatorServer
from infthor_sim.scenes.catalogue import Catalogue
from infthor_sim.simulation import Simulation

__all__ = ["fork_players"]

_MODULE = "infthor_sim.player"
_MOST_FILES = 4096
_POLL_S = 0.002


def fork_players() -> None:
    """Let this process, and its forks, start simulators as forks."""
    server = SimulatorServer(Simulation(Catalogue(None, None), Display(32, 32, antialias=True)))
    list(server.answer({"action": "Reset", "sceneName": "kitchen-1"}))  # loads the compiled code
    forking = SimpleNamespace(**{**vars(subprocess), "Popen": _Player})
    ai2thor.controller.subprocess = forking


class _Player:
    """What ai2thor asks of the process that it starts (`subprocess.Popen`)."""

    def __init__(
        self, command: Sequence[str], env: Mapping[str, str], stdout: IO[str], stderr: IO[str]
    ) -> None:
        self.returncode: int | None = None
        arguments = list(command[command.index(_MODULE) + 1 :])
        self.pid = os.fork()
        if not self.pid:
            _play(arguments, env, stdout.fileno())

    def poll(self) -> int | None:
        """Return the exit code; None while it runs."""
        if self.returncode is None:
            try:
                ended, status = os.waitpid(self.pid, os.WNOHANG)
            except ChildProcessError:  # waited for by another
                self.returncode = 0
            else:
                self.returncode = os.waitstatus_to_exitcode(status) if ended else None
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the end."""
        end = None if timeout is None else time.monotonic() + timeout
        while (code := self.poll()) is None:
            if end is not None and time.monotonic() > end:
                raise subprocess.TimeoutExpired(_MODULE, timeout or 0.0)
            time.sleep(_POLL_S)
        return code

    def kill(self) -> None:
        """Send SIGKILL."""
        if self.poll() is None:
            os.kill(self.pid, signal.SIGKILL)

    terminate = kill


def _play(arguments: list[str], environment: Mapping[str, str], log: int) -> None:
    """Be the simulator; does not return."""
    code = 70
    try:
        os.dup2(log, 1)
        os.dup2(log, 2)
        os.closerange(3, _MOST_FILES)  # or a lock would be held as long as the simulator lives
        os.environ.clear()
        os.environ.update(environment)
        code = main(arguments)
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 1
    except BaseException:  # noqa: BLE001 - as Python ends with whatever it is
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
