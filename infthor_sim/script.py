"""Running a script that is written for AI2-THOR, as it stands, on the simulator."""

import runpy
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import ai2thor.controller

from infthor_sim.controller import Controller

__all__ = ["run_script"]


def run_script(
    script: Path, arguments: Sequence[str], data: Path | None = None, supplement: Path | None = None
) -> None:
    """Run a script as `python SCRIPT ARGUMENTS` does, with this simulator's Controller.

    `ai2thor.controller.Controller` is replaced for the rest of the process. What the script raises,
    SystemExit too, is raised.

    Args:
        script: the file.
        arguments: its own, `sys.argv[1:]`.
        data: folder of recorded floor plans, for each Controller that names none.
        supplement: file with additions to them, likewise.
    """

    class ScriptController(Controller):
        """The Controller with the command's data."""

        def __init__(self, *words: Any, **options: Any) -> None:
            super().__init__(*words, **{"data": data, "supplement": supplement, **options})

    ai2thor.controller.Controller = ScriptController
    sys.argv = [str(script), *arguments]
    if not sys.flags.safe_path:
        sys.path[0] = str(script.resolve().parent)
    runpy.run_path(str(script), run_name="__main__")
