"""The final task: what it is about must have been seen at the two ends of the trajectory before it.

The object to pick up is among those `pickupable` in the first fifth of the steps and the receptacle (or lamp) among
those `visible` in the last fifth, or the other way round, so that solving the task needs what was seen long ago.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.tasks import Task

__all__ = ["SHARE", "EndTypes", "end_types", "violation"]

SHARE = 0.2


@dataclass(frozen=True)
class EndTypes:
    """The object types seen at the two ends of a trajectory: one end holds the object, the other the receptacle.

    Attributes:
        pickupable: at the end that holds the object.
        visible: at the end that holds the receptacle.
        either: visible at any of the two.
    """

    pickupable: frozenset[str]
    visible: frozenset[str]
    either: frozenset[str]

    def allows(self, pickup: str, other: str | None, movable: str | None = None) -> bool:
        """Whether a task on these types meets the rule; a carried receptacle may be from either end."""
        carried = movable is None or movable in self.either
        return carried and pickup in self.pickupable and other in self.visible

    def allows_task(self, task: Task) -> bool:
        """Whether a task meets the rule."""
        return self.allows(task.pickup, task.receptacle or task.light, task.movable)


def end_types(object_log: Sequence[dict[str, Any]]) -> tuple[EndTypes, EndTypes]:
    """The ends of the trajectory that a log tells of: with the object early, and the other way round.

    Args:
        object_log: one entry per frame, with the types that are visible and pickupable there.
    """
    count = max(1, math.floor(SHARE * len(object_log)))
    first, last = object_log[:count], object_log[-count:]
    either = _types(first, "visible") | _types(last, "visible")
    return (
        EndTypes(_types(first, "pickupable"), _types(last, "visible"), either),
        EndTypes(_types(last, "pickupable"), _types(first, "visible"), either),
    )


def violation(trajectory: Trajectory) -> str | None:
    """How a trajectory's final task breaks the rule, derived anew from its object log; None where it does not."""
    task = trajectory.long_horizon_task
    if task is None:
        return "there is no final task"
    before = trajectory.sub_trajs[-1].low_pddl_idx[0]
    info = task.task_info
    other = info.receptacle or task.pddl_params.get("toggle_target")
    either_way = end_types(trajectory.object_log[: before + 1])
    if info.pickup is not None and any(ends.allows(info.pickup, other, info.movable) for ends in either_way):
        return None
    return f"'{task.task_desc}' is not about types seen at both ends of the {before} steps before it"


def _types(entries: Sequence[dict[str, Any]], name: str) -> frozenset[str]:
    return frozenset(object_type for entry in entries for object_type in entry[name])
