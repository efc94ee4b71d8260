"""Command lines of simulators: the embedded one, a local Unity executable, or the build that
ai2thor downloads."""

import shlex
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.storage.limits import ACTION_SECONDS, UNITY_ACTION_SECONDS
from infthor_sim.launch import FRAMES, own_player, player_command


@dataclass(frozen=True)
class Launch:
    """The simulator to start, and its time limits.

    Attributes:
        label: "unity" or "embedded", which is recorded in the sets that it renders.
        executable: command line of the simulator; None for the build that ai2thor downloads.
        platform: name of ai2thor's platform for its own build ("CloudRendering" needs no X server).
        timeout: time limit of one reply, seconds.
        timeout_hint: the way to raise it, for messages.
        start_timeout: time limit of the first message, seconds.
        frames: version of the embedded simulator's drawing, which is recorded too; None for others.
    """

    executable: str | None = None
    label: str = "unity"
    platform: str | None = None
    timeout: float = 100.0
    timeout_hint: str = ""
    start_timeout: float = 300.0
    frames: int | None = None

    @property
    def is_embedded(self) -> bool:
        """Whether it is the embedded simulator."""
        return self.label == "embedded"

    def owned(self, command: list[str]) -> list[str]:
        """Return a command line of it, with what ends the embedded one with this process."""
        return own_player(command) if self.is_embedded else command


def embedded_launch(
    data: Path | None = None, supplement: Path | None = None, *, start_timeout: float = 300.0
) -> Launch:
    """Return the launch of the embedded simulator.

    Args:
        data: folder of recorded floor plans; without it there are only procedural scenes.
        supplement: file with additions to them from trajectories (see `thor.supplement`).
        start_timeout: time limit of the first message, seconds. The first start of an installation
            compiles the renderer, which takes ten seconds of a processor. Several at once on a busy
            machine take minutes, and one that is stopped in the middle would have to restart from
            the beginning.
    """
    return Launch(
        player_command(data, supplement),
        "embedded",
        timeout=ACTION_SECONDS.value,
        timeout_hint=ACTION_SECONDS.hint,
        start_timeout=start_timeout,
        frames=FRAMES,
    )


def unity_launch(executable: Path | None = None, *, platform: str | None = None) -> Launch:
    """Return the launch of a Unity build of AI2-THOR: a local executable, or the build that ai2thor
    downloads.
    """
    return Launch(
        None if executable is None else shlex.quote(str(executable)),
        platform=platform,
        timeout=UNITY_ACTION_SECONDS.value,
        timeout_hint=UNITY_ACTION_SECONDS.hint,
    )
