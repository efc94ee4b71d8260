"""The final task: what it is about must have been seen at the two ends of the trajectory before it.

The object to pick up is of a type seen in the first fifth and the receptacle (or lamp) of one seen in the last fifth,
or the other way round, so that solving the task needs what was seen long ago.
"""

import math
from collections.abc import Sequence
from typing import Any

from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.tasks import Task

__all__ = ["SHARE", "Ends", "ends_of", "violation"]

SHARE = 0.2


class Ends:
    """The object types seen at the two ends of a trajectory."""

    def __init__(self, early: set[str], late: set[str]) -> None:
        self.early = early
        self.late = late

    def allow(self, pickup: str, other: str | None, movable: str | None = None) -> bool:
        """Whether a task on these types meets the rule; a carried receptacle may be from either end."""
        if movable is not None and movable not in self.early | self.late:
            return False
        return (pickup in self.early and other in self.late) or (pickup in self.late and other in self.early)

    def allow_task(self, task: Task) -> bool:
        """Whether a task meets the rule."""
        return self.allow(task.pickup, task.receptacle or task.light, task.movable)


def ends_of(object_log: Sequence[dict[str, Any]]) -> Ends:
    """The ends of the trajectory that a log tells of.

    Args:
        object_log: one entry per frame, with the types that are visible there.
    """
    count = max(1, math.floor(SHARE * len(object_log)))
    early, late = object_log[:count], object_log[-count:]
    return Ends(*({object_type for entry in part for object_type in entry["visible"]} for part in (early, late)))


def violation(trajectory: Trajectory) -> str | None:
    """How a trajectory's final task breaks the rule, derived anew from its object log; None where it does not."""
    task = trajectory.long_horizon_task
    if task is None:
        return "there is no final task"
    before = trajectory.sub_trajs[-1].low_pddl_idx[0]
    ends = ends_of(trajectory.object_log[: before + 1])
    info = task.task_info
    other = info.receptacle or task.pddl_params.get("toggle_target")
    if info.pickup is not None and ends.allow(info.pickup, other, info.movable):
        return None
    return f"'{task.task_desc}' is not about types seen at both ends of the {before} steps before it"
