"""Trajectories cut down to their first plans.

They are those of a bundled set as it once was, kept here: the bundled sets are made again when
rooms change, and tests name plans by number.
"""

import gzip
import json
from functools import cache
from pathlib import Path
from typing import Any

from infthor_eval.formats.trajectory import Trajectory, iter_trajectories

FORK = "kitchen-2-seed4"  # put a fork in the drawer: go, pick up, look, put; then another task
MUG = "bedroom-1-seed7"  # put a mug on the desk: go, pick up, go, put
CANDLE = "living-room-2-seed4"  # look at a candle under the floor lamp
LAMP = "bedroom-120-seed0"  # its lamp is on before it is gone to, in sub-goal 8

_KEPT = Path(__file__).parent / "trajectories.jsonl.gz"


def read_trajectory(name: str) -> Trajectory:
    """A trajectory that is not cut."""
    return next(item for item in iter_trajectories(_KEPT) if item.traj_id == name)


@cache
def _documents() -> dict[str, str]:
    """The documents by their names."""
    with gzip.open(_KEPT, "rt") as lines:
        return {json.loads(line)["traj_id"]: line for line in lines}


def cut_trajectory(
    name: str, n_plans: int = 4, *, final: bool = False, called: str | None = None
) -> dict[str, Any]:
    """The document of a trajectory of the first sub-goals of another.

    Args:
        name: the other one.
        n_plans: how many of its sub-goals are kept, each with an action.
        final: whether the last task that is left is its long-horizon task.
        called: its name; the other one's if None.
    """
    document = json.loads(_documents()[name])
    plan = document["plan"]
    plan["high_pddl"] = plan["high_pddl"][:n_plans]
    plan["low_actions"] = [low for low in plan["low_actions"] if low["high_idx"] < n_plans]
    parts = [part for part in document["sub_trajs"] if part["high_pddl_idx"][0] < n_plans]
    for part in parts:
        for key, end in (("high_pddl_idx", n_plans), ("low_pddl_idx", len(plan["low_actions"]))):
            part[key] = [part[key][0], min(part[key][1], end)]
    document |= {
        "sub_trajs": parts,
        "sub_tasks": document["sub_tasks"][: len(parts)],
        "images": [],
        "object_log": [],
    }
    if final:
        document["long_horizon_task"] = document["sub_tasks"][-1]
    return document | {"traj_id": called or name}


def write_trajectories(folder: Path, *documents: dict[str, Any]) -> Path:
    """Write trajectory files into a new folder, and return it."""
    folder.mkdir(parents=True)
    for document in documents:
        (folder / f"{document['traj_id']}.json").write_text(json.dumps(document))
    return folder
