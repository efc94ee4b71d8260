"""The conditions of a task's goal, one by one, for ALFRED's goal-condition success.

They are those of ALFRED's `goal_conditions_met` (`env/tasks.py`, Shridhar et al., CVPR 2020): a hot
potato in the fridge is one in the fridge, a hot one, and one that is both. The goal holds
(`household.goals`) where all are met.
"""

from collections import Counter
from typing import NamedTuple

from infthor_eval.household.goals import APPLIANCE
from infthor_eval.household.symbolic import room_of
from infthor_eval.household.tasks import Task, TaskType
from infthor_eval.household.treatments import Treatments
from infthor_eval.thor.view import SimulatorView


class GoalConditions(NamedTuple):
    """How many conditions of a goal are met, and how many there are."""

    met: int
    total: int


def goal_conditions(task: Task, view: SimulatorView, treatments: Treatments) -> GoalConditions:
    """Return the conditions of a task's goal now, given what was washed, heated and cooled."""
    types = {key: obj.object_type for key, obj in view.objects.items()}
    parents = dict(room_of(view).start.where)
    targets = {key for key, object_type in types.items() if object_type in task.targets}
    two = 2 if task.task_type == TaskType.PLACE_TWO else 1
    slices = GoalConditions(min(len(targets), two), two) if task.sliced else GoalConditions(0, 0)
    if task.task_type == TaskType.EXAMINE:
        held = any(view.objects[key].is_picked_up for key in targets)
        lit = any(
            obj.object_type == task.light and obj.is_toggled and obj.visible
            for obj in view.objects.values()
        )
        others = [held, lit]
    elif task.task_type == TaskType.STACK:
        carriers = {key for key, object_type in types.items() if object_type == task.movable}
        filled = {parents[key] for key in targets if parents.get(key) in carriers}
        there = {key for key in carriers if types.get(parents.get(key, "")) == task.receptacle}
        others = [bool(filled), bool(there), bool(filled & there)]
    else:
        placed = {key for key in targets if types.get(parents.get(key, "")) == task.receptacle}
        if task.task_type == TaskType.PLACE_TWO:
            n_together = max(Counter(parents[key] for key in placed).values(), default=0)
            others = [n_together >= 1, n_together >= 2]
        elif task.task_type in APPLIANCE:
            treated = targets & _treated(task.task_type, treatments)
            others = [bool(placed), bool(treated), bool(placed & treated)]
        else:
            others = [bool(placed) and not (task.task_type == TaskType.PUT_AWAY and view.inventory)]
    return GoalConditions(slices.met + sum(others), slices.total + len(others))


def _treated(task_type: TaskType, treatments: Treatments) -> frozenset[str]:
    return {
        TaskType.CLEAN: treatments.clean,
        TaskType.HEAT: treatments.hot,
        TaskType.COOL: treatments.cold,
    }[task_type]
