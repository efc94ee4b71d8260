"""The 120 floor plans of iTHOR from public repositories: objects of one, cells of another.

`Kajiih/rl_ai2thor` (MIT) has the metadata of every object as AI2-THOR 5 reports it,
`askforalfred/alfred` (MIT) the positions that the agent can reach.
"""

import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.floor_plans import write_floor_plan

HOST = "https://raw.githubusercontent.com"
# at fixed commits, so that everybody has the same scenes
_OBJECTS = (
    "Kajiih/rl_ai2thor/5907c98545245efc0f060db55e5d2307de8801d2/"
    "dev/data/objects_metadata_samples/{}_physics.json"
)
_CELLS = "askforalfred/alfred/f91f4c0c96c7a29f33d0557f86b0a21035379b3b/gen/layouts/{}-layout.npy"
_PATIENCE_S = 60.0
_LARGEST = 16 << 20  # bytes; the files have up to 0.5 MB
# kitchens, living rooms, bedrooms, bathrooms
PUBLISHED_SCENES: Sequence[str] = tuple(
    f"FloorPlan{first + number}" for first in (0, 200, 300, 400) for number in range(1, 31)
)


def fetch_scene(scene: str, folder: Path, host: str = HOST, overwrite: bool = False) -> int:
    """Download a floor plan into a folder of recorded ones; return its number of objects.

    Args:
        scene: one of `PUBLISHED_SCENES`.
        host: where the repositories' files are.
        overwrite: True to replace a different recording of the scene.
    """
    objects = _objects(f"{host}/{_OBJECTS.format(scene)}")
    cells = _cells(f"{host}/{_CELLS.format(scene)}")
    write_floor_plan(folder, scene, objects, cells, overwrite)
    return len(objects)


def _objects(address: str) -> list[dict[str, Any]]:
    content = _download(address)
    with wrap_errors(f"{address}: not metadata of objects", "try again", catch=ValueError):
        by_id = json.loads(content)
    if not isinstance(by_id, dict) or not by_id or not all(map(_is_object, by_id.values())):
        raise DataError(f"{address}: not metadata of objects; try again")
    return list(by_id.values())


def _is_object(entry: Any) -> bool:
    return isinstance(entry, dict) and {"objectId", "objectType", "position"} <= set(entry)


def _cells(address: str) -> list[tuple[float, float]]:
    content = io.BytesIO(_download(address))
    with wrap_errors(f"{address}: not an array", "try again", catch=(ValueError, EOFError)):
        cells = np.load(content, allow_pickle=False)
    if cells.ndim != 2 or cells.shape[1] != 2 or not np.isfinite(cells).all():
        raise DataError(f"{address}: not positions (n, 2); try again")
    return [(float(x), float(z)) for x, z in cells]


def _download(address: str) -> bytes:
    """Return the content of a file on the network, which is an http or https address."""
    hint = "check the connection, or name the scenes that you need"
    with (
        wrap_errors(f"{address}: cannot be downloaded", hint),
        urlopen(address, timeout=_PATIENCE_S) as reply,
    ):
        content: bytes = reply.read(_LARGEST + 1)
    if len(content) > _LARGEST:
        raise DataError(f"{address}: has more than {_LARGEST >> 20} MB; give another host")
    return content
