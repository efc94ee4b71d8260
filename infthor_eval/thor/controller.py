"""The Controller of ai2thor 5.0.0 on the safe transport."""

from pathlib import Path
from typing import Any

import ai2thor.controller

from infthor_eval.errors import SceneError, SimulatorError
from infthor_eval.storage.scratch import ScratchFolder
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.transport import PeerFault, SafeFifoServer

_ANY_DISPLAY = "0"  # ai2thor requires some DISPLAY; a simulator without a window does not use it


def scene_name(scene: str | dict[str, Any] | None) -> str:
    """Return a scene's name for messages."""
    return "(a house)" if isinstance(scene, dict) else str(scene)


class SafeController(ai2thor.controller.Controller):
    """An `ai2thor.controller.Controller` that never hangs, and removes its process, pipes and
    files.

    A simulator started from an executable has its log in a temporary folder instead of
    `~/.ai2thor`.
    """

    def __init__(self, launch: Launch, scene: str | dict[str, Any], **options: Any) -> None:
        """Start the simulator and load a scene.

        Args:
            scene: name of the scene, or a house description.
            options: options of ai2thor's Controller (`width`, `renderInstanceSegmentation`, ...).
        """
        self.server: SafeFifoServer | None = None
        self._launch = launch
        self._folder = None if launch.executable is None else ScratchFolder()
        try:
            super().__init__(
                scene=scene,
                local_executable_path=launch.executable,
                platform=launch.platform,
                server_class=SafeFifoServer,
                server_timeout=launch.timeout,
                server_start_timeout=launch.start_timeout,
                x_display=None if launch.executable is None else _ANY_DISPLAY,
                **options,
            )
        except PeerFault as fault:
            raise self._with_log(fault) from fault
        except OSError as error:
            self.stop()
            what = launch.executable or "AI2-THOR's own build"
            raise SimulatorError(
                f"{what}: cannot be started ({error}); check the command, or the network"
            ) from error
        except (RuntimeError, ValueError) as error:
            # ai2thor raises the same classes for a scene and for a build that does not exist.
            self.stop()
            message = " ".join(str(error).split())[:300]
            if (
                "no build exists" in message
            ):  # its message also if the download server cannot be reached
                raise SimulatorError(
                    "AI2-THOR's Unity build is not installed and cannot be downloaded; go online "
                    "once, or name an executable"
                ) from error
            raise SceneError(f"scene {scene_name(scene)}: {message}") from error
        except BaseException:
            self.stop()
            raise

    @property
    def base_dir(self) -> str:
        """Folder of ai2thor's log and releases."""
        return super().base_dir if self._folder is None else str(self._folder.path)

    @property
    def scenes_in_build(self) -> set[str]:
        """Scenes that can be loaded; none for all: the embedded simulator has no last one."""
        if self._launch.is_embedded:
            return set()
        listed: set[str] = super().scenes_in_build
        return listed

    def reset(self, scene: str | dict[str, Any] | None = None, **init_params: Any) -> Any:
        """Load a scene as ai2thor's method does, but raise SimulatorError if the simulator
        fails."""
        try:
            return super().reset(scene, **init_params)
        except PeerFault as fault:
            raise self._with_log(fault) from fault

    def step(self, action: str | dict[str, Any] | None = None, **action_args: Any) -> Any:
        """Run one action as ai2thor's method does, but raise SimulatorError if the simulator
        fails."""
        try:
            return super().step(action, **action_args)
        except PeerFault as fault:
            raise self._with_log(fault) from fault
        except (RuntimeError, TimeoutError) as error:
            # ai2thor wraps the errors of `receive` in one of these two, so the fault is taken from
            # the server.
            if self.server is None or self.server.fault is None:
                raise
            raise self._with_log(self.server.fault) from error

    def stop(self) -> None:
        """Kill and reap the simulator, and remove its pipes and temporary files. Calling it again
        does nothing."""
        if self.server is not None:
            self.server.stop()
        # ai2thor registers an exit handler that keeps this object alive, so the large event is
        # released here.
        self.last_event = None
        build = getattr(self, "_build", None)
        if build is not None:
            build.unlock()
            self._build = None
        if self._folder is not None:
            self._folder.cleanup()

    def unity_command(self, width: int, height: int, headless: bool) -> list[str]:
        """Return the command line of the simulator."""
        if self._folder is not None:
            self.gpu_device = (
                None  # for a GPU number ai2thor would run vulkaninfo, which many machines lack
            )
        command: list[str] = super().unity_command(width, height, headless)
        return self._launch.owned(command)

    def _build_server(self, host: str, port: int, width: int, height: int) -> None:
        if self.server is None:
            self.server = SafeFifoServer(
                width, height, self.server_timeout, self.depth_format, self.add_depth_noise
            )

    def _with_log(self, fault: PeerFault) -> PeerFault:
        """Stop the simulator and return the fault with the last line of its log."""
        line = self._last_log_line()
        self.stop()
        return PeerFault(
            fault.fault_type, f"{fault}; its log ends with: {line}" if line else str(fault)
        )

    def _last_log_line(self) -> str:
        log = Path(self.log_dir) / "unity.log"
        if not log.is_file():
            return ""
        lines = log.read_text(errors="replace").split("\n")
        return next((line.strip()[:200] for line in reversed(lines) if line.strip()), "")
