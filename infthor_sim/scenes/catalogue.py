"""Scene names, the builders of their worlds, and recorded floor plans on disk.

A data folder holds `thor_scenes/objects.jsonl.gz` (one `{"scene", "objects"}` a line: objects as
AI2-THOR 5 reported them) and `alfred/layouts/FloorPlan<N>-layout.npy` (reachable (x, z), metres).
"""

import gzip
import json
import re
import tokenize
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from infthor_sim.agent import AGENT_HEIGHT, Agent
from infthor_sim.errors import DataError, in_one_line
from infthor_sim.geometry import Array
from infthor_sim.physics.navigation import NavGrid
from infthor_sim.saved_state import SavedState
from infthor_sim.scenes.floorplan import build_floor_plan
from infthor_sim.scenes.procedural import SCENE_TYPES, build_scene
from infthor_sim.scenes.supplement import Supplement, read_supplement
from infthor_sim.world import RoomShell, World

_LISTED = 1000  # procedural scenes of each kind that `names` has; there is no last one
_PROCEDURAL = re.compile(r"([a-z-]+)-(\d+)")
_ROBOTHOR = re.compile(r"FloorPlan_(Train|Val|Test|RVal|test-dev|test-challenge)\d+_\d+")
_ITHOR = re.compile(r"FloorPlan\d+")
_FLOOR_PLAN = re.compile(r"FloorPlan(_[A-Za-z0-9_]+|\d+)")
# What a floor plan whose fields are missing or of other types raises.
_MALFORMED = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError)
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


class Catalogue:
    """Builds a new world for a scene name.

    The last procedural one is kept, as a scene is often loaded again.

    Args:
        data: folder with recorded floor plans, see `FloorPlanData`; None for none.
        supplement: file with additions from trajectories, see `Supplement`; None for none.
    """

    def __init__(self, data: Path | None = None, supplement: Path | None = None) -> None:
        self._folder = data
        self._data = None if data is None else FloorPlanData(data)
        self._assets: dict[str, tuple[float, float, float]] | None = None
        self._supplement_path = supplement
        self._supplement: Mapping[str, Supplement] | None = None if supplement is not None else {}
        self._last: tuple[tuple[str, int], SavedState[World]] | None = None

    def load(self, name: str) -> World:
        """Return the world of a scene name."""
        name = name.removesuffix("_physics")
        if name == "Procedural":  # which the client loads before it creates a house
            return self.empty()
        if _FLOOR_PLAN.fullmatch(name):
            return self._floor_plan(name)
        procedural = _PROCEDURAL.fullmatch(name)
        if procedural and procedural[1] in SCENE_TYPES:
            return self._procedural(procedural[1], int(procedural[2]))
        names = ", ".join(f"{scene_type}-<seed>" for scene_type in SCENE_TYPES)
        raise DataError(f"Scene {name!r} is unknown; use {names}, or FloorPlan<N> with --data")

    def names(self) -> list[str]:
        """Return names as AI2-THOR has them: recorded floor plans, the first procedural scenes."""
        recorded = [] if self._data is None else self._data.scenes()
        return [
            *(f"{name}_physics" if _ITHOR.fullmatch(name) else name for name in recorded),
            *(f"{kind}-{seed}" for kind in SCENE_TYPES for seed in range(1, _LISTED + 1)),
            "Procedural",
        ]

    def empty(self) -> World:
        """Return a bare room, the state before the first Reset and before CreateHouse."""
        room = RoomShell(-1.5, 1.5, -1.5, 1.5)
        cells = [(x * 0.25, z * 0.25) for x in range(-4, 5) for z in range(-4, 5)]
        return World(
            "Procedural", {}, (room,), NavGrid(cells), [Agent(np.array([0.0, AGENT_HEIGHT, 0.0]))]
        )

    def house(self, house: Mapping[str, Any]) -> World:
        """Return the world of a ProcTHOR house."""
        from infthor_sim.scenes.procthor import build_house, read_asset_sizes

        if self._assets is None:
            self._assets = {} if self._folder is None else read_asset_sizes(self._folder)
        return build_house(house, self._assets)

    def _procedural(self, scene_type: str, seed: int) -> World:
        if self._last is None or self._last[0] != (scene_type, seed):
            self._last = (scene_type, seed), SavedState(build_scene(scene_type, seed))
        return self._last[1].copy()

    def _floor_plan(self, name: str) -> World:
        if _ROBOTHOR.fullmatch(name) and (self._data is None or name not in self._data.scenes()):
            raise DataError(
                f"{name} is an apartment of RoboTHOR, of which there is no recording; use "
                "house-<seed>, a procedural one, with agentMode='locobot'"
            )
        if self._data is None:
            raise DataError(
                f"Scene {name} needs recorded data: give the folder that has "
                "thor_scenes/objects.jsonl.gz and"
                " alfred/layouts/ (run and watch: --scenes DIR; other commands: --data DIR); "
                "`infthor-eval scenes fetch --out DIR` makes one"
            )
        if self._supplement is None:
            assert self._supplement_path is not None
            self._supplement = read_supplement(self._supplement_path)
        extra = self._supplement.get(name, Supplement())
        objects = self._data.objects(name)
        cells = self._data.cells(name)
        try:
            return build_floor_plan(name, objects, cells, extra)
        except _MALFORMED as error:
            raise DataError(
                f"{name}: its recording is malformed ({in_one_line(error)}); record it again"
            ) from error


class FloorPlanData:
    """Reads floor plans from a data folder."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._lines: dict[str, str] | None = None

    def scenes(self) -> list[str]:
        """Return the names of the floor plans, in the order of the file."""
        return list(self._index())

    def objects(self, scene: str) -> list[dict[str, Any]]:
        """Return the metadata of every object of a floor plan."""
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
        """Return a floor plan's reachable (x, z), metres (n, 2); None without a layout of it."""
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
