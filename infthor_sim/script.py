"""Running a script that is written for AI2-THOR, as it stands, on the simulator."""

import io
import os
import pkgutil
import sys
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import ai2thor.controller

from infthor_sim.controller import Controller
from infthor_sim.errors import DataError, in_one_line


def use_simulator(data: Path | None = None, supplement: Path | None = None) -> None:
    """Put this simulator's Controller in the place of ai2thor's, for the rest of the process.

    Args:
        data: folder of recorded floor plans, for each Controller that names none.
        supplement: file with additions to them, likewise.
    """

    class ScriptController(Controller):
        """The Controller with the command's data."""

        def __init__(self, *words: Any, **options: Any) -> None:
            super().__init__(*words, **{"data": data, "supplement": supplement, **options})

    ai2thor.controller.Controller = ScriptController


def prepare_script(script: str) -> tuple[ModuleType, CodeType]:
    """Return the `__main__` that `python SCRIPT` makes, and its code; put its place on `sys.path`.

    Args:
        script: a file, or a folder or zip with `__main__.py`, as typed.
    """
    # Joined as python does it: neither dots nor links are resolved.
    place = os.path.join(os.getcwd(), script)  # noqa: PTH109, PTH118
    finder = pkgutil.get_importer(place)
    if finder is not None:
        spec = finder.find_spec("__main__")
        if spec is None:
            raise DataError(f"{script}: there is no __main__.py in it")
        sys.path.insert(0, place)
        loader_of_main: Any = spec.loader
        return module_from_spec(spec), loader_of_main.get_code("__main__")
    try:
        content = Path(place).read_bytes()
    except OSError as error:
        raise DataError(f"{script}: cannot be read ({in_one_line(error)})") from error
    if not sys.flags.safe_path:
        sys.path.insert(0, str(Path(place).resolve().parent))
    main = ModuleType("__main__")
    loader = SourceFileLoader("__main__", place)
    main.__dict__.update(__file__=place, __cached__=None, __loader__=loader)
    compiled = pkgutil.read_code(io.BytesIO(content))  # None if it is no .pyc
    return main, compiled or loader.source_to_code(content, place)
