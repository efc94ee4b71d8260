"""Writing floor plans into a folder of recorded ones (`--data`).

The folder has `thor_scenes/objects.jsonl.gz`, one `{"scene", "objects"}` a line with every object's metadata as
AI2-THOR 5.x reports it (boxes without corner points), and `alfred/layouts/FloorPlan<N>-layout.npy`, reachable (x, z)
in metres.
"""

import gzip
import io
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.digests import digest_of_files
from infthor_eval.formats.files import OVERWRITE_HINT, refuse_overwrite, write_atomically
from infthor_eval.formats.reading import json_lines_of

__all__ = ["floor_plan_names", "floor_plans_digest", "write_floor_plan"]

_OBJECTS = Path("thor_scenes") / "objects.jsonl.gz"


def floor_plan_names(root: Path) -> list[str]:
    """The floor plans that a folder of recorded ones has.

    Raises:
        DataError: the folder's file of objects is missing or not what it should be.
    """
    return [scene for scene, _ in _recorded(root / _OBJECTS)]


def floor_plans_digest(root: Path) -> str:
    """Hash of all that a folder of recorded floor plans has.

    Raises:
        DataError: the folder's file of objects is not there, or a file cannot be read.
    """
    if not (root / _OBJECTS).is_file():
        raise DataError(f"{root}: no {_OBJECTS} in it; give the folder of recorded floor plans")
    with wrap_errors(f"{root}: cannot be read", "restore it, or give another folder"):
        return digest_of_files([root / _OBJECTS, *sorted(root.glob("alfred/layouts/*.npy"))])


def write_floor_plan(
    root: Path,
    scene: str,
    objects: Sequence[dict[str, Any]],
    cells: Sequence[tuple[float, float]],
    overwrite: bool = False,
) -> None:
    """Add a floor plan to a folder of recorded ones.

    Args:
        root: the folder; made where it does not exist.
        scene: name of the floor plan.
        objects: metadata of every object, as AI2-THOR reports it.
        cells: reachable (x, z), metres.
        overwrite: whether it may take the place of another recording of that name.

    Raises:
        DataError: the folder has another recording of it, or its file of objects cannot be read or written.
    """
    path = root / _OBJECTS
    line = json.dumps({"scene": scene, "objects": [_without_corners(item) for item in objects]})
    recorded = dict(_recorded(path)) if path.exists() else {}
    layout = _layout(root, scene, objects, cells)
    if not overwrite:
        if recorded.get(scene, line) != line:
            raise DataError(f"{path}: has {scene} already and holds something else of it; {OVERWRITE_HINT}")
        for file, content in layout.items():
            refuse_overwrite(file, content)
    kept = [other for name, other in recorded.items() if name != scene]
    with wrap_errors(f"{path}: {scene} cannot be added", "give another folder"):
        for file, content in layout.items():
            file.parent.mkdir(parents=True, exist_ok=True)
            with write_atomically(file) as partial:
                partial.write_bytes(content)
        path.parent.mkdir(parents=True, exist_ok=True)
        with write_atomically(path) as partial, gzip.open(partial, "wt", encoding="utf-8") as packed:
            packed.writelines(f"{text}\n" for text in [*kept, line])


def _layout(
    root: Path, scene: str, objects: Sequence[dict[str, Any]], cells: Sequence[tuple[float, float]]
) -> dict[Path, bytes]:
    """The small files of a floor plan: the cells, and the types that there are."""
    array = io.BytesIO()
    np.save(array, np.array(cells, dtype=np.float64).reshape(-1, 2))
    types = sorted({item["objectType"] for item in objects})
    folder = root / "alfred" / "layouts"
    return {
        folder / f"{scene}-layout.npy": array.getvalue(),
        folder / f"{scene}-objects.json": f"{json.dumps(types, indent=1)}\n".encode(),
    }


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
