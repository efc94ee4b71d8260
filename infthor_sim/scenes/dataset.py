"""Recorded floor plans on disk: objects as AI2-THOR 5 reported them, and cells of the agent.

A data folder holds `thor_scenes/objects.jsonl.gz` (one `{"scene", "objects"}` a line) and
`alfred/layouts/FloorPlan<N>-layout.npy` (reachable (x, z), metres).
"""

import gzip
import json
import tokenize
import zlib
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from infthor_sim.errors import DataError, in_one_line
from infthor_sim.geometry import Array

_OBJECTS = Path("thor_scenes/objects.jsonl.gz")
_LAYOUTS = Path("alfred/layouts")
# What numpy raises on a damaged file: its header is a Python literal.
_NO_ARRAY = (
    OSError,
    ValueError,
    TypeError,
    EOFError,
    SyntaxError,
    OverflowError,
    tokenize.TokenError,
    BadZipFile,
)
_FAR = 1e5  # metres from the origin that no recorded cell is
_KEY = '{"scene":"'  # the usual start of a line


class FloorPlanData:
    """Reads floor plans from a data folder."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._lines: dict[str, str] | None = None

    def scenes(self) -> list[str]:
        """Return the names of the floor plans, in the order of the file.

        Raises:
            DataError: the file cannot be read.
        """
        return list(self._index())

    def objects(self, scene: str) -> list[dict[str, Any]]:
        """Return the metadata of every object of a floor plan.

        Raises:
            DataError: the file or the floor plan is not there, or its line is not JSON.
        """
        line = self._index().get(scene)
        path = self._root / _OBJECTS
        if line is None:
            raise DataError(
                f"{path}: has no {scene}; it has {len(self._index())} other floor plans"
            )
        try:
            objects: list[dict[str, Any]] = json.loads(line)["objects"]
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise DataError(
                f"{path}: the line of {scene} is not of the form scene, objects ({error})"
            ) from error
        return objects

    def cells(self, scene: str) -> Array | None:
        """Return a floor plan's reachable (x, z), metres (n, 2); None without a layout of it.

        Raises:
            DataError: the layout is not an array of that form.
        """
        path = self._root / _LAYOUTS / f"{scene}-layout.npy"
        if not path.exists():
            return None
        try:
            # Mapped, so that a header that promises more numbers than there are is refused and
            # fills no memory.
            cells: Array = np.array(np.load(path, allow_pickle=False, mmap_mode="r"))
        except _NO_ARRAY as error:
            raise DataError(
                f"{path}: not a readable layout ({in_one_line(error)}); record it again"
            ) from error
        if cells.ndim != 2 or cells.shape[1] != 2:
            raise DataError(f"{path}: must be an array (n, 2), not {cells.shape}")
        if cells.dtype.kind not in "fiu" or not bool((np.abs(cells) < _FAR).all()):
            raise DataError(f"{path}: must be numbers in metres; record the floor plan again")
        return cells

    def _index(self) -> dict[str, str]:
        """Return unparsed lines by scene."""
        # Only the requested line is parsed: one takes 2 ms, all of them 0.2 s.
        if self._lines is None:
            path = self._root / _OBJECTS
            try:
                with gzip.open(path, "rt", encoding="utf-8") as file:
                    lines = [line for line in file if line.strip()]
            except (OSError, EOFError, UnicodeDecodeError, zlib.error) as error:
                raise DataError(
                    f"{path}: cannot be read ({error}); --data must name a folder laid out like "
                    "the published data"
                ) from error
            self._lines = {
                _scene_of(path, number, line): line for number, line in enumerate(lines, start=1)
            }
        return self._lines


def _scene_of(path: Path, number: int, line: str) -> str:
    """Return the scene of a line, without parsing it if it starts as usual."""
    compact = line[:80].replace('": "', '":"')
    if compact.startswith(_KEY):
        return compact[len(_KEY) :].split('"', 1)[0]
    try:
        return str(json.loads(line)["scene"])
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise DataError(
            f"{path}: line {number} is not of the form scene, objects ({error})"
        ) from error
