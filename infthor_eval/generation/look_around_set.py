"""Adding what looking around inserts to trajectory files that exist, as the published script does.

The JSON is written as that script writes it: the new low-level actions, their numbers, the ranges
of the tasks and `gen_info`. All else is passed on as it is; `object_log` and `images`, which have
an entry for each low-level action, still are those of the actions before. A replay makes new ones.
"""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.reading import require_file
from infthor_eval.formats.trajectory import TrajectorySource, iter_sources, trajectory_files
from infthor_eval.generation.look_around import (
    INSERTED,
    MIN_RUN,
    LevelWalk,
    inserted_before,
    level_walks,
    with_looks,
)
from infthor_eval.storage.files import write_atomically, writing_hint

_HORIZON = 30  # degrees, where the initial pose has none, as published
_HINT = "give a .json file of one trajectory, or a folder of them"


@dataclass
class LookAroundSummary:
    """Numbers of a call.

    Attributes:
        trajectories: number of trajectories that were written.
        changed: number of those in which something was inserted.
        steps: number of low-level actions in all of them, with those inserted.
        inserted: number of inserted actions.
    """

    trajectories: int = 0
    changed: int = 0
    steps: int = 0
    inserted: int = 0


def look_around_files(path: Path, out: Path, min_run: int = MIN_RUN) -> LookAroundSummary:
    """Write the trajectories of a file or folder with what looking around inserts.

    Args:
        path: a `.json` file, or a folder of them.
        out: the new file, or the folder of the new files, which have the same names.
        min_run: see `level_walks`.
    """
    summary = LookAroundSummary()
    for source in _sources(path):
        document = _document(source)
        n_inserted = add_look_around(document, source.place, min_run)
        summary.trajectories += 1
        summary.changed += n_inserted > 0
        summary.steps += len(document["plan"]["low_actions"])
        summary.inserted += n_inserted
        inside = str(source.path).removeprefix(f"{path}/")
        _write(document, out / inside if path.is_dir() else out)
    return summary


def _sources(path: Path) -> Iterable[TrajectorySource]:
    files = trajectory_files(path)
    for file in files:
        require_file(file, _HINT)
        if not file.name.endswith(".json"):
            raise DataError(f"{file}: not a .json file; {_HINT}")
    return (source for file in files for source in iter_sources(file))


def _document(source: TrajectorySource) -> dict[str, Any]:
    """Return a checked trajectory's JSON as it is in the file."""
    source.read()
    with wrap_errors(f"{source.place}: not JSON", _HINT, catch=(ValueError, RecursionError)):
        document = json.loads(source.raw)
    assert isinstance(document, dict)
    return document


def _write(document: dict[str, Any], path: Path) -> None:
    with wrap_errors(f"{path}: cannot be written", writing_hint(", or give another place")):
        path.parent.mkdir(parents=True, exist_ok=True)
        with write_atomically(path) as partial:
            partial.write_text(json.dumps(document))


def add_look_around(document: dict[str, Any], place: str, min_run: int = MIN_RUN) -> int:
    """Change the JSON of a trajectory as the published script does.

    Args:
        document: a trajectory's JSON, decoded; changed in place.
        place: file of the trajectory, for messages.
        min_run: see `level_walks`.

    Returns:
        The number of inserted actions.
    """
    actions = document["plan"]["low_actions"]
    if any(action.get("inserted") == INSERTED for action in actions):
        raise DataError(f"{place}: looks around already; give the trajectory without it")
    horizon = document["scene"]["init_action"].get("horizon", _HORIZON)
    names = [action["api_action"]["action"] for action in actions]
    walks = level_walks(names, horizon, min_run)
    for part in document.get("sub_trajs", []):
        part["low_pddl_idx"] = _shifted(part["low_pddl_idx"], walks, len(actions), place)

    def look(name: str, walk: LevelWalk) -> dict[str, Any]:
        before = actions[walk.first - 1].get("high_idx", 0)
        owner = before if name == "LookUp" else actions[walk.end].get("high_idx", before)
        call = {"action": name, "renderImage": True}
        return {"api_action": call, "high_idx": owner, "inserted": INSERTED}

    changed = with_looks(actions, walks, look)
    for index, action in enumerate(changed):
        action["low_idx"] = index
    document["plan"]["low_actions"] = changed
    n_inserted = len(changed) - len(actions)
    if document.get("gen_info") is None:
        document["gen_info"] = {}
    document["gen_info"]["look_around_retrofit"] = {"added": n_inserted, "min_run": min_run}
    return n_inserted


def _shifted(bounds: list[int], walks: list[LevelWalk], n_actions: int, place: str) -> list[int]:
    first, end = bounds
    if not 0 <= first <= n_actions or end < 0:
        raise DataError(
            f"{place}: a task has the actions {first} to {end}, of {n_actions}; restore the file"
        )
    return [first + inserted_before(walks, first), end + inserted_before(walks, end)]
