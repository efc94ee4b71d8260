"""Folders of recorded floor plans (`--data`), and files of ProcTHOR's houses.

`thor_scenes/objects.jsonl.gz` has one `{"scene", "objects"}` per line: the metadata of every object
as AI2-THOR 5.x reports it (boxes without corner points). `alfred/layouts/FloorPlan<N>-layout.npy`
has the reachable (x, z), in metres. Of houses of ProcTHOR there are files, too.
"""

import gzip
import io
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.reading import json_lines_of, read_json
from infthor_eval.storage.digests import canonical_json, digest, digest_of_files
from infthor_eval.storage.files import OVERWRITE_HINT, file_name, refuse_overwrite, write_atomically

_OBJECTS = Path("thor_scenes") / "objects.jsonl.gz"
_PARTS = ("rooms", "walls", "objects")
_HOUSE_HINT = "give the JSON of one house, as ProcTHOR generates it"


def floor_plan_names(root: Path) -> list[str]:
    """Return the names of the recorded floor plans in a folder."""
    return [scene for scene, _ in _read_scenes(root / _OBJECTS)]


def floor_plans_digest(root: Path) -> str:
    """Return the hash of a folder of recorded floor plans."""
    if not (root / _OBJECTS).is_file():
        raise DataError(f"{root}: has no {_OBJECTS}; give the folder of recorded floor plans")
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
        root: the folder; created if it does not exist.
        scene: name of the floor plan.
        objects: metadata of every object from AI2-THOR.
        cells: reachable (x, z), metres.
        overwrite: True to replace a different recording of the same name.
    """
    if file_name(scene) != scene:
        raise DataError(f"{scene!r:.80} cannot name a file; give the name of a scene")
    path = root / _OBJECTS
    line = json.dumps({"scene": scene, "objects": [_without_corners(item) for item in objects]})
    recorded = dict(_read_scenes(path)) if path.exists() else {}
    layout = _layout_files(root, scene, objects, cells)
    if not overwrite:
        if recorded.get(scene, line) != line:
            raise DataError(
                f"{path}: has a different recording of {scene} already; {OVERWRITE_HINT}"
            )
        for file, content in layout.items():
            refuse_overwrite(file, content)
    others = [other for name, other in recorded.items() if name != scene]
    with wrap_errors(f"{path}: {scene} cannot be added", "give another folder"):
        for file, content in layout.items():
            file.parent.mkdir(parents=True, exist_ok=True)
            with write_atomically(file) as partial:
                partial.write_bytes(content)
        path.parent.mkdir(parents=True, exist_ok=True)
        with (
            write_atomically(path) as partial,
            gzip.open(partial, "wt", encoding="utf-8") as packed,
        ):
            packed.writelines(f"{text}\n" for text in [*others, line])


def _layout_files(
    root: Path, scene: str, objects: Sequence[dict[str, Any]], cells: Sequence[tuple[float, float]]
) -> dict[Path, bytes]:
    """Return the content of a floor plan's small files: reachable cells, and object types."""
    array = io.BytesIO()
    np.save(array, np.array(cells, dtype=np.float64).reshape(-1, 2))
    types = sorted({item["objectType"] for item in objects})
    folder = root / "alfred" / "layouts"
    return {
        folder / f"{scene}-layout.npy": array.getvalue(),
        folder / f"{scene}-objects.json": f"{json.dumps(types, indent=1)}\n".encode(),
    }


def _read_scenes(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the name and the line of each scene in a file of objects."""
    for entry in json_lines_of(path, "give a folder of recorded floor plans with --data"):
        scene = entry.get("scene")
        if not isinstance(scene, str):
            raise DataError(
                f"{path}: a line has no scene name; give a folder of recorded floor plans with "
                "--data"
            )
        yield scene, json.dumps(entry)


def _without_corners(metadata: dict[str, Any]) -> dict[str, Any]:
    box = metadata.get("axisAlignedBoundingBox") or {}
    kept = {key: value for key, value in box.items() if key != "cornerPoints"}
    return {**metadata, "axisAlignedBoundingBox": kept}


def read_house(path: Path) -> tuple[str, dict[str, Any]]:
    """Return a house's name as a scene, by its content, and its JSON."""
    house = read_json(path, _HOUSE_HINT)
    if not isinstance(house, dict) or not all(isinstance(house.get(part), list) for part in _PARTS):
        raise DataError(f"{path}: has not the lists {', '.join(_PARTS)} of a house; {_HOUSE_HINT}")
    return f"procthor-{digest(canonical_json(house), 5)}", house
