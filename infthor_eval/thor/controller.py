"""The Controller of ai2thor 5.0.0 on the safe transport, cleaning up behind itself."""

from pathlib import Path
from typing import Any

import ai2thor.controller

from infthor_eval.errors import SceneError, SimulatorError
from infthor_eval.formats.scratch import ScratchFolder
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.transport import PeerFault, SafeFifoServer

__all__ = ["SafeController"]

_ANY_DISPLAY = "0"  # Popen needs some DISPLAY; a simulator without a window never looks at it


class SafeController(ai2thor.controller.Controller):
    """`ai2thor.controller.Controller` that never hangs and leaves nothing behind.

    A simulator started from an executable keeps its log in a temporary folder instead of `~/.ai2thor`.
    """

    def __init__(self, launch: Launch, scene: str | dict[str, Any], **options: Any) -> None:
        """Start the simulator and load a scene.

        Args:
            launch: what to start.
            scene: name of the scene, or a house description.
            options: of ai2thor's Controller (`width`, `renderInstanceSegmentation`, ...).

        Raises:
            SceneError: it refuses the scene.
            SimulatorError: it does not start.
        """
        self.server: SafeFifoServer | None = None
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
            raise self._explained(fault) from fault
        except OSError as error:
            self.stop()
            what = launch.executable or "AI2-THOR's own build"
            raise SimulatorError(f"{what}: cannot be started ({error}); check the command, or the network") from error
        except (RuntimeError, ValueError) as error:
            # Also what ai2thor says of a scene or a build that does not exist.
            self.stop()
            message = " ".join(str(error).split())[:300]
            if "no build exists" in message:  # what ai2thor says where it cannot reach its download server either
                raise SimulatorError(
                    "AI2-THOR's Unity build is neither here nor to be downloaded; go online once, or name an executable"
                ) from error
            raise SceneError(f"scene {_scene_name(scene)}: {message}") from error
        except BaseException:
            self.stop()
            raise

    @property
    def base_dir(self) -> str:
        """Where ai2thor keeps its log and releases."""
        return super().base_dir if self._folder is None else str(self._folder.path)

    def reset(self, scene: str | dict[str, Any] | None = None, **init_params: Any) -> Any:
        """Load a scene; as the published method, but a failed simulator raises SimulatorError."""
        try:
            return super().reset(scene, **init_params)
        except PeerFault as fault:
            raise self._explained(fault) from fault

    def step(self, action: str | dict[str, Any] | None = None, **action_args: Any) -> Any:
        """Run one action; as the published method, but a failed simulator raises SimulatorError."""
        try:
            return super().step(action, **action_args)
        except PeerFault as fault:
            raise self._explained(fault) from fault
        except (RuntimeError, TimeoutError) as error:
            # ai2thor wraps what receive() raised in one of these two.
            if self.server is None or self.server.fault is None:
                raise
            raise self._explained(self.server.fault) from error

    def stop(self) -> None:
        """Kills and reaps the simulator, removes pipes and temporary files. Safe to call again."""
        if self.server is not None:
            self.server.stop()
        # ai2thor registers an exit handler that keeps this object alive: let go of what is large.
        self.last_event = None
        build = getattr(self, "_build", None)
        if build is not None:
            build.unlock()
            self._build = None
        if self._folder is not None:
            self._folder.cleanup()

    def unity_command(self, width: int, height: int, headless: bool) -> list[str]:
        """The command line; an executable at hand is never told a GPU, which ai2thor asks vulkaninfo for."""
        if self._folder is not None:
            self.gpu_device = None
        return super().unity_command(width, height, headless)

    def _build_server(self, host: str, port: int, width: int, height: int) -> None:
        if self.server is None:
            self.server = SafeFifoServer(width, height, self.server_timeout, self.depth_format, self.add_depth_noise)

    def _explained(self, fault: PeerFault) -> PeerFault:
        """The fault with the last line that the simulator logged, the simulator stopped."""
        words = self._last_words()
        self.stop()
        return PeerFault(fault.fault_type, f"{fault}; its log ends with: {words}" if words else str(fault))

    def _last_words(self) -> str:
        log = Path(self.log_dir) / "unity.log"
        if not log.is_file():
            return ""
        lines = log.read_text(errors="replace").split("\n")
        return next((line.strip()[:200] for line in reversed(lines) if line.strip()), "")


def _scene_name(scene: str | dict[str, Any]) -> str:
    return scene if isinstance(scene, str) else "(a house)"
