"""The final task, whose objects must have been seen at both ends of the trajectory before it.

The object to pick up is among those `pickupable` in the first fifth of the steps and the receptacle
(or lamp) among those `visible` in the last fifth, or vice versa. So the task requires to remember
what was seen long ago, unless that was seen later, too. With `alone` it was not, nor the other one
before the last fifth.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.tasks import Task

SHARE = 0.2  # of the frames, at either end


@dataclass(frozen=True)
class EndTypes:
    """Types seen at a trajectory's ends: the object's at one, the receptacle's at the other.

    Attributes:
        pickupable: types that can be picked up, at the end with the object.
        visible: types that are visible at the end with the receptacle.
        either: types that are visible at either end.
    """

    pickupable: frozenset[str]
    visible: frozenset[str]
    either: frozenset[str]

    def allows(self, pickup: str, other: str | None, movable: str | None = None) -> bool:
        """Return True if a task on these types fits the rule; `movable` may be of either end."""
        carried = movable is None or movable in self.either
        return carried and pickup in self.pickupable and other in self.visible

    def allows_task(self, task: Task) -> bool:
        """Return True if a task satisfies the rule."""
        return self.allows(task.pickup, task.receptacle or task.light, task.movable)


def end_types(
    object_log: Sequence[dict[str, Any]], alone: bool = False
) -> tuple[EndTypes, EndTypes]:
    """Return the types at a log's ends (an entry per frame), with the object early and late.

    With `alone` these are types that no other frame shows, but for what is carried with them.
    """
    count = max(1, math.floor(SHARE * len(object_log)))
    first = object_log[:count]
    last = object_log[-count:]
    either = _types(first, "visible") | _types(last, "visible")
    later = _seen(object_log[count:]) if alone else frozenset()
    before = _seen(object_log[:-count]) if alone else frozenset()
    return (
        EndTypes(_types(first, "pickupable") - later, _types(last, "visible") - before, either),
        EndTypes(_types(last, "pickupable") - before, _types(first, "visible") - later, either),
    )


def violation(trajectory: Trajectory, alone: bool = False) -> str | None:
    """Return how a final task violates the rule, by the object log, or None if it does not."""
    task = trajectory.long_horizon_task
    if task is None:
        return "there is no final task"
    before = trajectory.sub_trajs[-1].low_pddl_idx[0]
    info = task.task_info
    other = info.receptacle or task.pddl_params.get("toggle_target")
    for ends in end_types(trajectory.object_log[: before + 1], alone):
        if info.pickup is not None and ends.allows(info.pickup, other, info.movable):
            return None
    return (
        f"'{task.task_desc}' is not about types seen at both ends of the {before} steps before it"
    )


def _types(entries: Sequence[dict[str, Any]], name: str) -> frozenset[str]:
    return frozenset(object_type for entry in entries for object_type in entry[name])


def _seen(entries: Sequence[dict[str, Any]]) -> frozenset[str]:
    """Return the types that are visible, and those of which slices are."""
    types = _types(entries, "visible")
    return types | {name.removesuffix("Sliced") for name in types}
