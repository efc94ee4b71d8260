"""Writing floor plans into a folder of recorded ones (`--data`).

The folder has `thor_scenes/objects.jsonl.gz`, one `{"scene", "objects"}` a line with every object's metadata as
AI2-THOR 5.x reports it (boxes without corner points), and `alfred/layouts/FloorPlan<N>-layout.npy`, reachable (x, z)
in metres.
"""

import gzip
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from infthor_eval.errors import DataError, naming
from infthor_eval.formats.files import written_atomically
from infthor_eval.formats.reading import json_lines_of

__all__ = ["floor_plan_names", "write_floor_plan"]

_OBJECTS = Path("thor_scenes") / "objects.jsonl.gz"


def floor_plan_names(root: Path) -> list[str]:
    """The floor plans that a folder of recorded ones has.

    Raises:
        DataError: the folder's file of objects is missing or not what it should be.
    """
    return [scene for scene, _ in _recorded(root / _OBJECTS)]


def write_floor_plan(
    root: Path, scene: str, objects: Sequence[dict[str, Any]], cells: Sequence[tuple[float, float]]
) -> None:
    """Add a floor plan to a folder of recorded ones, in place of what it has of that name.

    Args:
        root: the folder; made where it does not exist.
        scene: name of the floor plan.
        objects: metadata of every object, as AI2-THOR reports it.
        cells: reachable (x, z), metres.

    Raises:
        DataError: the folder's file of objects cannot be read or written.
    """
    path = root / _OBJECTS
    layouts = root / "alfred" / "layouts"
    line = json.dumps({"scene": scene, "objects": [_without_corners(item) for item in objects]})
    kept = [line for name, line in _recorded(path) if name != scene] if path.exists() else []
    with naming(f"{path}: {scene} cannot be added", "give another folder"):
        path.parent.mkdir(parents=True, exist_ok=True)
        layouts.mkdir(parents=True, exist_ok=True)
        np.save(layouts / f"{scene}-layout.npy", np.array(cells, dtype=np.float64).reshape(-1, 2))
        types = sorted({item["objectType"] for item in objects})
        (layouts / f"{scene}-objects.json").write_text(json.dumps(types, indent=1) + "\n", encoding="utf-8")
        with written_atomically(path) as partial, gzip.open(partial, "wt", encoding="utf-8") as file:
            file.writelines(f"{text}\n" for text in [*kept, line])


def _recorded(path: Path) -> Iterator[tuple[str, str]]:
    """The scenes in a file of objects, each with its line."""
    for entry in json_lines_of(path, "give a folder of recorded floor plans with --data"):
        scene = entry.get("scene")
        if not isinstance(scene, str):
            raise DataError(f"{path}: a line has no scene's name; give a folder of recorded floor plans with --data")
        yield scene, json.dumps(entry)


def _without_corners(item: dict[str, Any]) -> dict[str, Any]:
    box = item.get("axisAlignedBoundingBox") or {}
    kept = {key: value for key, value in box.items() if key != "cornerPoints"}
    return {**item, "axisAlignedBoundingBox": kept}
