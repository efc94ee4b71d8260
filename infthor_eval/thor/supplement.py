"""Additions to recorded floor plans, taken from the trajectories that are replayed in them.

Scene data may be recorded by another AI2-THOR version than the trajectories, and their navigation
grid has gaps. Where the expert walked there must be floor, and what it opened, switched or put
things into must exist.
"""

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.storage.scratch import ScratchFolder
from infthor_eval.thor.recorded import degrees_of

_GRID = 0.25
_HEADINGS = {"MoveAhead": 0.0, "MoveRight": 90.0, "MoveBack": 180.0, "MoveLeft": 270.0}
_ON_FIXED = {"OpenObject", "CloseObject", "ToggleObjectOn", "ToggleObjectOff"}


@dataclass
class _FloorPlan:
    floor_y: float
    cells: set[tuple[float, float]] = field(default_factory=set)
    objects: set[str] = field(default_factory=set)


def write_supplement(trajectories: Iterable[Trajectory], path: Path) -> None:
    """Write the additions to each floor plan as JSON.

    The content is `{floor plan: {"cells": [[x, z], ...], "floor_y": y, "objects": [id, ...]}}`:
    positions (metres) where the agent stood, the agent's height, and ids of the fixed objects that
    it acted on.
    """
    plans: dict[str, _FloorPlan] = {}
    for trajectory in trajectories:
        scene = trajectory.scene
        plan = plans.setdefault(scene.floor_plan, _FloorPlan(scene.init_action.y))
        plan.cells.update(agent_path(trajectory))
        plan.objects.update(_fixed_objects(trajectory))
    document = {
        name: {
            "cells": sorted(plan.cells),
            "floor_y": plan.floor_y,
            "objects": sorted(plan.objects),
        }
        for name, plan in sorted(plans.items())
    }
    path.write_bytes(msgspec.json.encode(document))


@contextmanager
def supplement_file(trajectories: Iterable[Trajectory]) -> Iterator[Path]:
    """Yield a temporary file with the additions to each floor plan, see `write_supplement`."""
    with ScratchFolder() as folder:
        path = folder / "supplement.json"
        write_supplement(trajectories, path)
        yield path


def agent_path(trajectory: Trajectory) -> list[tuple[float, float]]:
    """Return the agent's (x, z) positions, metres, if all actions succeed; the first too."""
    start = trajectory.scene.init_action
    x = start.x
    z = start.z
    yaw = start.yaw
    path = [(_round(x), _round(z))]
    for low in trajectory.plan.low_actions:
        name = low.api_action.action
        if name in {"RotateLeft", "RotateRight"}:
            yaw += degrees_of(low) if name == "RotateRight" else -degrees_of(low)
        elif name in _HEADINGS:
            length = low.api_action.move_magnitude or _GRID
            heading = math.radians(yaw + _HEADINGS[name])
            x, z = x + length * math.sin(heading), z + length * math.cos(heading)
            path.append((_round(x), _round(z)))
    return path


def _round(value: float) -> float:
    return round(value, 4) + 0.0  # adding 0.0 turns -0.0 into 0.0


def _fixed_objects(trajectory: Trajectory) -> set[str]:
    ids = set()
    for low in trajectory.plan.low_actions:
        api = low.api_action
        if api.receptacle_id is not None:
            ids.add(api.receptacle_id)
        if api.action in _ON_FIXED and api.object_id is not None:
            ids.add(api.object_id)
    return ids
