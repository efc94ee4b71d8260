"""Trajectories in which what is held after a task is put away in a sub-goal of its own, as the
published ones have it.

Ours have a walk and a put between two tasks, which belong to none. The published generator of July
2026 makes a task of them, with one PutObject that names types, and with its walk among its actions.
Older files have its sub-goal alone.
"""

import json
from pathlib import Path
from typing import Any

from infthor_eval.formats.trajectory import Trajectory, TrajectorySource

from ..helpers.trajectories import FORK, cut_trajectory

# look at a pen under the desk lamp; the pen goes to the dining table; look at a mug
PEN = "living-room-1-seed3"
_N_PLANS = 10  # of PEN, of which 4 and 5 put the pen away


def pen_put_away(**changes: Any) -> dict[str, Any]:
    """The document of PEN with its pen put away in a task of its own."""
    document = cut_trajectory(PEN, _N_PLANS, **changes)
    plan, (before, after) = document["plan"], document["sub_trajs"]
    first, end = before["high_pddl_idx"][1], after["high_pddl_idx"][0]
    put = next(low["api_action"] for low in plan["low_actions"] if low["high_idx"] == end - 1)
    held, place = (put[key].split("|")[0] for key in ("objectId", "receptacleObjectId"))
    n_fewer = end - first - 1
    for low in plan["low_actions"]:
        low["high_idx"] = (
            min(low["high_idx"], first) if low["high_idx"] < end else low["high_idx"] - n_fewer
        )
    after["high_pddl_idx"] = [number - n_fewer for number in after["high_pddl_idx"]]
    low = before["low_pddl_idx"][1], after["low_pddl_idx"][0]
    plan["high_pddl"][first:end] = []
    return _with_task(document, held, place, first, low)


def put_away_without_actions(name: str = FORK, n_plans: int = 6, **changes: Any) -> dict[str, Any]:
    """A document with a sub-goal without actions behind its first task, as files of before July
    2026."""
    document = cut_trajectory(name, n_plans, **changes)
    before, *later = document["sub_trajs"]
    first, low = before["high_pddl_idx"][1], before["low_pddl_idx"][1]
    for action in document["plan"]["low_actions"][low:]:
        action["high_idx"] += 1
    for part in later:
        part["high_pddl_idx"] = [number + 1 for number in part["high_pddl_idx"]]
    return _with_task(document, "Fork", "Drawer", first, (low, low))


def _with_task(
    document: dict[str, Any], held: str, place: str, first: int, low: tuple[int, int]
) -> dict[str, Any]:
    """Insert the task of putting away behind the first one, with its one sub-goal."""
    high = {
        "discrete_action": {"action": "PutObject", "args": [held, place]},
        "planner_action": {"action": "PutObject", "objectId": held, "receptacleObjectId": place},
    }
    goals = document["plan"]["high_pddl"]
    goals.insert(first, high)
    for number, item in enumerate(goals):
        item["high_idx"] = number
    text = f"put the {held} on the {place}"
    before, *rest = document["sub_trajs"]
    own = {"high_pddl_idx": [first, first + 1], "low_pddl_idx": list(low), "subgoal": text}
    parts = [before, own, *rest]
    document["sub_trajs"] = [part | {"sub_traj_idx": number} for number, part in enumerate(parts)]
    info = {"goal": "put object", "movable": held, "pickup": None, "receptacle": place}
    # Its parameters are those of the task before it, as the generator leaves them.
    params = document["sub_tasks"][0]["pddl_params"]
    task = {"task_info": info | {"scene": "1"}, "task_desc": text, "pddl_params": params}
    document["sub_tasks"].insert(1, task)
    return document


def read(document: dict[str, Any]) -> Trajectory:
    """A document as it is read."""
    return TrajectorySource(Path("here.json"), None, json.dumps(document).encode()).read()
