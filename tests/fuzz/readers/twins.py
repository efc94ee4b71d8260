"""Twins: their pairs, pictures, questions and manifest, and final tasks of a pair."""

import json
import shutil
from functools import partial
from pathlib import Path

from infthor_eval.errors import InfthorError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.formats.twins import read_pairs
from infthor_eval.generation.bundle import read_manifest
from infthor_eval.nieh.samples import find_samples, open_set
from infthor_eval.nieh.set_contents import read_contents
from infthor_eval.storage.folders import packaged_folder

from ...helpers.twin_sets import write_twin_set
from ..damage import Form
from ..reader import Reader
from .samples import trajectory_document

__all__ = ["READERS"]

_SETTINGS = {"tokens_per_frame": 100, "ctx_size": 0.3, "seed": 0}
_WORLD = "metadata/kitchen-1-a"


def _make(pattern: str, folder: Path) -> Path:
    write_twin_set(folder)
    return min(folder.glob(pattern))


def _make_picture(folder: Path) -> Path:
    name = _make(f"{_WORLD}/frames.txt", folder).read_text().splitlines()[0]
    return folder / "frames" / f"{name}.png"


def _ask(folder: Path) -> None:
    """Prepare every question of the worlds, and load what is shown."""
    read_contents(NiehSet(folder))
    for context in ("clues", "trajectory"):
        open_set.cache_clear()
        found = find_samples({"context": context, "data": str(folder), **_SETTINGS})
        for sample in found.samples:
            is_sound = sample.question.traj_id.startswith("kitchen-2")
            try:
                for part in found.request(sample)[0]:
                    if hasattr(part, "problem"):
                        assert part.problem is not None or part.load().size == (160, 160)
            except InfthorError:
                assert not is_sound, f"{context}: a sound question is refused"


def _read(folder: Path) -> None:
    read_pairs(folder)
    _ask(folder)


def _question_file(folder: Path) -> None:
    data = NiehSet(folder)
    assert all(item.reason for item in data.skipped)
    _ask(folder)


def _make_manifest(folder: Path) -> Path:
    shutil.copy(packaged_folder("sets/nieh_mini_twins") / "manifest.json", folder)
    document = json.loads((folder / "manifest.json").read_text())
    document["files"] = dict(list(document["files"].items())[:5])
    (folder / "manifest.json").write_text(json.dumps(document))
    return folder / "manifest.json"


def _make_trajectory(folder: Path) -> Path:
    place = {"receptacleObjectId": "Bed|1", "x": 0.5, "z": 1.0}
    world = {"pair": "p", "base": "b", "kind": "swap", "places": [place, place]}
    (folder / "a.json").write_text(json.dumps(trajectory_document("t") | {"twin": world}))
    return folder / "a.json"


READERS = (
    Reader("pairs of twins", Form.JSON_LINES, partial(_make, "twins.jsonl"), _read),
    Reader("questions of twins", Form.CSV, partial(_make, "qa_set_twins.csv"), _question_file),
    Reader("names of shared frames", Form.TEXT, partial(_make, f"{_WORLD}/frames.txt"), _ask),
    Reader("shared frame", Form.BYTES, _make_picture, _ask),
    Reader("step log of a world", Form.JSON, partial(_make, f"{_WORLD}/metadata.json"), _ask),
    Reader(
        "manifest of twins",
        Form.JSON,
        _make_manifest,
        lambda folder: read_manifest(folder / "manifest.json"),
    ),
    Reader(
        "trajectory of a world",
        Form.JSON,
        _make_trajectory,
        lambda folder: list(iter_trajectories(folder / "a.json")),
    ),
)
