"""Additions to recorded floor plans from trajectories.

The file is JSON, one entry per floor plan:

    {"FloorPlan10": {"cells": [[x, z], ...], "floor_y": 0.9009992, "objects":
    ["Fridge|-00.33|+00.00|-00.77", ...]}}

`cells` are positions of the agent that the trajectories visit (metres), `floor_y` is the agent's
height there, and `objects` are ids of fixed things that they interact with. All three may be
absent.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from infthor_sim.errors import DataError


@dataclass(frozen=True)
class Supplement:
    """Additions to one floor plan; see the module.

    Attributes:
        cells: positions (x, z) of the agent, metres.
        floor_y: height of the agent's position, metres; None if unknown.
        objects: ids of fixed objects.
    """

    cells: tuple[tuple[float, float], ...] = ()
    floor_y: float | None = None
    objects: tuple[str, ...] = ()


def read_supplement(path: Path) -> dict[str, Supplement]:
    """Return the entries of a supplement file by floor plan."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise DataError(
            f"{path}: not a readable supplement ({error}); write it again with the replay command"
        ) from error
    if not isinstance(content, Mapping):
        raise DataError(f"{path}: must be a JSON object by floor plan")
    return {str(name): _entry(path, str(name), value) for name, value in content.items()}


def _entry(path: Path, name: str, value: Any) -> Supplement:
    try:
        cells = tuple((float(x), float(z)) for x, z in value.get("cells", ()))
        floor = value.get("floor_y")
        objects = tuple(sorted({str(item) for item in value.get("objects", ())}))
        return Supplement(cells, None if floor is None else float(floor), objects)
    except (AttributeError, TypeError, ValueError, OverflowError) as error:
        raise DataError(
            f"{path}: entry {name} is not of the form cells, floor_y, objects ({error})"
        ) from error
