"""What trajectories tell of the floor plans they were recorded in.

Recorded scene data may be of another AI2-THOR version than the trajectories, and its navigation grid has
gaps. Where the expert walked there is floor, and what it opened, switched and put things into is there.
"""

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from infthor_eval.formats.scratch import ScratchFolder
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.thor.recorded import degrees_of

__all__ = ["agent_path", "supplement_file", "write_supplement"]

_GRID = 0.25
_HEADINGS = {"MoveAhead": 0.0, "MoveRight": 90.0, "MoveBack": 180.0, "MoveLeft": 270.0}
_ON_FIXED = {"OpenObject", "CloseObject", "ToggleObjectOn", "ToggleObjectOff"}


@dataclass
class _FloorPlan:
    floor_y: float
    cells: set[tuple[float, float]] = field(default_factory=set)
    objects: set[str] = field(default_factory=set)


def write_supplement(trajectories: Iterable[Trajectory], path: Path) -> None:
    """Write what the trajectories tell of each floor plan.

    The file is `{floor plan: {"cells": [[x, z], ...], "floor_y": y, "objects": [id, ...]}}`: cells (metres)
    where the agent stood, the agent's height, ids of the fixed objects it acted on.

    Args:
        trajectories: of any number of floor plans.
        path: of the file.
    """
    plans: dict[str, _FloorPlan] = {}
    for trajectory in trajectories:
        scene = trajectory.scene
        plan = plans.setdefault(scene.floor_plan, _FloorPlan(scene.init_action.y))
        plan.cells.update(agent_path(trajectory))
        plan.objects.update(_fixed_objects(trajectory))
    document = {
        name: {"cells": sorted(plan.cells), "floor_y": plan.floor_y, "objects": sorted(plan.objects)}
        for name, plan in sorted(plans.items())
    }
    path.write_bytes(msgspec.json.encode(document))


@contextmanager
def supplement_file(trajectories: Iterable[Trajectory]) -> Iterator[Path]:
    """What the trajectories tell of each floor plan, in a temporary file."""
    with ScratchFolder() as folder:
        path = folder / "supplement.json"
        write_supplement(trajectories, path)
        yield path


def agent_path(trajectory: Trajectory) -> list[tuple[float, float]]:
    """The (x, z) positions, metres, that the agent passes if every action succeeds, the first included."""
    start = trajectory.scene.init_action
    x, z, yaw = start.x, start.z, start.yaw
    path = [(_rounded(x), _rounded(z))]
    for low in trajectory.plan.low_actions:
        name = low.api_action.action
        if name in {"RotateLeft", "RotateRight"}:
            yaw += degrees_of(low) if name == "RotateRight" else -degrees_of(low)
        elif name in _HEADINGS:
            length = low.api_action.move_magnitude or _GRID
            heading = math.radians(yaw + _HEADINGS[name])
            x, z = x + length * math.sin(heading), z + length * math.cos(heading)
            path.append((_rounded(x), _rounded(z)))
    return path


def _rounded(value: float) -> float:
    return round(value, 4) + 0.0  # no negative zero


def _fixed_objects(trajectory: Trajectory) -> set[str]:
    found = set()
    for low in trajectory.plan.low_actions:
        api = low.api_action
        if api.receptacle_id is not None:
            found.add(api.receptacle_id)
        if api.action in _ON_FIXED and api.object_id is not None:
            found.add(api.object_id)
    return found
