"""The command line that starts the simulator as the player behind an ai2thor Controller."""

import os
import shlex
import sys
from pathlib import Path

FRAMES = 2
"""Version of what pictures look like, which sets record: of shapes and of the rooms around them."""


def player_command(data: Path | str | None = None, supplement: Path | str | None = None) -> str:
    """Return the command line of the simulator, for ai2thor's `local_executable_path`.

    Args:
        data: folder of recorded floor plans (`scenes.dataset`); None: procedural scenes alone.
        supplement: file with additions to them from trajectories (`scenes.supplement`).
    """
    # -P: a numpy.py in the folder where one stands is none of its modules.
    words = [sys.executable, "-P", "-m", "infthor_sim.player"]
    if data is not None:
        words += ["--data", str(Path(data).resolve())]
    if supplement is not None:
        words += ["--supplement", str(Path(supplement).resolve())]
    return shlex.join(words)


def own_player(command: list[str], files: Path | str | None = None) -> list[str]:
    """Return the command line of a simulator that this process starts, and that ends with it.

    Without it, a simulator whose Controller is killed while it imports would wait for ever.

    Args:
        command: the command line.
        files: a temporary folder, which the simulator removes if this process is killed.
    """
    owned = [*command, "--controller", str(os.getpid())]
    return owned if files is None else [*owned, "--files", str(files)]
