"""Scene names, and the builders of their worlds."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from infthor_sim.agent import AGENT_HEIGHT, Agent
from infthor_sim.errors import DataError, in_one_line
from infthor_sim.physics.navigation import NavGrid
from infthor_sim.scenes.dataset import FloorPlanData
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


class Catalogue:
    """Builds a new world for a scene name.

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

    def load(self, name: str) -> World:
        """Return the world of a scene name.

        Raises:
            DataError: the name is unknown, or its data are missing; the message says which.
        """
        name = name.removesuffix("_physics")
        if name == "Procedural":  # which the client loads before it creates a house
            return self.empty()
        if _FLOOR_PLAN.fullmatch(name):
            return self._floor_plan(name)
        procedural = _PROCEDURAL.fullmatch(name)
        if procedural and procedural[1] in SCENE_TYPES:
            return build_scene(procedural[1], int(procedural[2]))
        names = ", ".join(f"{scene_type}-<seed>" for scene_type in SCENE_TYPES)
        raise DataError(f"Scene {name!r} is unknown; use {names}, or FloorPlan<N> with --data")

    def names(self) -> list[str]:
        """Return names as AI2-THOR has them: recorded floor plans, the first procedural scenes.

        Raises:
            DataError: the recorded floor plans cannot be read.
        """
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
        """Return the world of a ProcTHOR house.

        Raises:
            DataError: it does not have ProcTHOR's form.
        """
        from infthor_sim.scenes.procthor import build_house, read_asset_sizes

        if self._assets is None:
            self._assets = {} if self._folder is None else read_asset_sizes(self._folder)
        return build_house(house, self._assets)

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
