"""Bundled trajectories cut down to their first plans."""

import json
from pathlib import Path
from typing import Any

from infthor_eval.formats.packaged import packaged_folder

FORK = "kitchen-2-seed4"  # put a fork in the drawer: go, pick up, look, put; then another task
MUG = "bedroom-1-seed7"  # put a mug on the desk: go, pick up, go, put
CANDLE = "living-room-2-seed4"  # look at a candle under the floor lamp


def cut(name: str, n_plans: int = 4, *, final: bool = False, called: str | None = None) -> dict[str, Any]:
    """The document of a trajectory of the first sub-goals of a bundled one.

    Args:
        name: the bundled one.
        n_plans: how many of its sub-goals are kept, each with an action.
        final: whether the last task that is left is its long-horizon task.
        called: its name; the bundled one's if None.
    """
    path = packaged_folder("sets/nieh_mini") / "metadata" / name / "traj_data.json"
    document = json.loads(path.read_text())
    plan = document["plan"]
    plan["high_pddl"] = plan["high_pddl"][:n_plans]
    plan["low_actions"] = [low for low in plan["low_actions"] if low["high_idx"] < n_plans]
    kept = [part for part in document["sub_trajs"] if part["high_pddl_idx"][0] < n_plans]
    for part in kept:
        for key, end in (("high_pddl_idx", n_plans), ("low_pddl_idx", len(plan["low_actions"]))):
            part[key] = [part[key][0], min(part[key][1], end)]
    document |= {"sub_trajs": kept, "sub_tasks": document["sub_tasks"][: len(kept)], "images": [], "object_log": []}
    if final:
        document["long_horizon_task"] = document["sub_tasks"][-1]
    return document | {"traj_id": called or name}


def write(folder: Path, *documents: dict[str, Any]) -> Path:
    """Trajectory files of a new folder."""
    folder.mkdir(parents=True)
    for document in documents:
        (folder / f"{document['traj_id']}.json").write_text(json.dumps(document))
    return folder
