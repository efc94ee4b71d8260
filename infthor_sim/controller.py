"""AI2-THOR's Controller, started on this simulator instead of Unity."""

import inspect
import os
import select
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import ai2thor.controller
from ai2thor.fifo_server import FifoServer

from infthor_sim.errors import SimulatorError
from infthor_sim.launch import own_player, player_command

_DEFAULT_SCENE = "kitchen-1"
_ANY_DISPLAY = "0"  # ai2thor looks for an X server if it is given none; the simulator opens none
_WATCH_SECONDS = 0.1  # interval at which the wait for the first state checks the process


class Controller(ai2thor.controller.Controller):
    """An `ai2thor.controller.Controller` whose player is this simulator; also a context manager.

    It takes all arguments of ai2thor's, by position or by name. Those that choose a build, a screen
    or a transport have no effect: `local_executable_path`, `local_build`, `commit_id`, `branch`,
    `platform`, `x_display`, `gpu_device`, `server_class`, `start_unity`. It writes nothing to
    `~/.ai2thor`, and its process ends with `stop`, with the context, or with Python, and so do its
    temporary files, also where Python is killed.
    """

    server: Any

    def __init__(
        self,
        *arguments: Any,
        data: Path | str | None = None,
        supplement: Path | str | None = None,
        **options: Any,
    ) -> None:
        """Start the simulator and load a scene; without `scene`, a procedural kitchen.

        Args:
            arguments: ai2thor's, by position.
            data: folder of recorded floor plans, without which there are no `FloorPlan<N>`.
            supplement: file with additions to them from trajectories.
            options: ai2thor's by name, and those of `Initialize` (`gridSize`, `agentMode`, ...).

        Raises:
            RuntimeError: the simulator has no such scene, or refuses an option.
            SimulatorError: the simulator's process does not start.
        """
        self._files = _temporary_folder()
        bound = inspect.signature(super().__init__).bind(*arguments, **options)
        scene = bound.arguments.get("scene")
        initialization = bound.arguments.pop("unity_initialization_parameters", {})
        chosen = {
            **bound.arguments,
            "scene": _DEFAULT_SCENE if scene is None else scene,
            "local_executable_path": player_command(data, supplement),
            "x_display": _ANY_DISPLAY,
            "gpu_device": None,
            "server_class": FifoServer,
            "start_unity": True,
        }
        try:
            super().__init__(**chosen, **initialization)
        except BaseException:
            self.stop()
            raise

    @property
    def base_dir(self) -> str:
        """Folder of ai2thor's logs and releases: a temporary one."""
        return self._files.name

    @property
    def scenes_in_build(self) -> set[str]:
        """No names, so that every scene is tried: there is no last procedural one."""
        return set()

    def unity_command(self, width: int, height: int, headless: bool) -> list[str]:
        """Return the command line of the simulator's process."""
        # ai2thor takes one from CUDA_VISIBLE_DEVICES, and would run vulkaninfo to find it.
        self.gpu_device = None
        return own_player(super().unity_command(width, height, headless), self._files.name)

    def start(self, *arguments: Any, **options: Any) -> Any:
        """Start the simulator's process; where it runs already, only return the last event.

        Scripts for older versions of AI2-THOR call it after the constructor.
        """
        process = None if self.server is None else self.server.unity_proc
        if process is not None and process.poll() is None:
            return self.last_event
        if self.last_event is not None:  # of a process that has ended, with its pipes
            self.server = None
            self._files.cleanup()
            self._files = _temporary_folder()
        return super().start(*arguments, **options)

    def stop(self) -> None:
        """End the simulator's process and remove its files. Calling it again does nothing."""
        server = self.server
        if server is not None:
            server.stop()
            if server.unity_proc is not None:
                server.unity_proc.wait()
        self._files.cleanup()

    def _build_server(self, *arguments: Any) -> None:
        super()._build_server(*arguments)
        # With all other files, so that the simulator can remove them if this process is killed.
        self.server.tmp_dir.cleanup()
        self.server.server_pipe_path = str(Path(self._files.name, "server.pipe"))
        self.server.client_pipe_path = str(Path(self._files.name, "client.pipe"))

    def _start_unity_thread(self, *arguments: Any) -> None:
        super()._start_unity_thread(*arguments)
        self._await_first_state(self.server.unity_proc)

    def _await_first_state(self, process: subprocess.Popen[bytes]) -> None:
        """Open the pipe of states once there is one to read.

        ai2thor's own blocking open would wait for ever for a process that could not start.
        """
        pipe = os.open(self.server.server_pipe_path, os.O_RDONLY | os.O_NONBLOCK)
        self.server.server_pipe = os.fdopen(pipe, "rb")
        poll = select.poll()
        poll.register(pipe, select.POLLIN)
        while not poll.poll(_WATCH_SECONDS * 1000):
            if process.poll() is not None:
                log = Path(self.log_dir, "unity.log").read_text(errors="replace").split("\n")
                reason = next((line.strip() for line in reversed(log) if line.strip()), "")
                raise SimulatorError(f"the simulator does not start: {reason}")
        os.set_blocking(pipe, True)


def _temporary_folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="infthor-sim-", ignore_cleanup_errors=True)
