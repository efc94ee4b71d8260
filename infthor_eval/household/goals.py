"""Goal conditions of tasks, and the planner's lower bound on the operators still needed."""

from collections import Counter
from dataclasses import replace
from typing import NamedTuple

from infthor_eval.household.affordances import KNIVES
from infthor_eval.household.symbolic import State, SymbolicRoom, room_of
from infthor_eval.household.tasks import Task, TaskType
from infthor_eval.household.treatments import Treatments
from infthor_eval.thor.view import SimulatorView

APPLIANCE = {TaskType.CLEAN: "SinkBasin", TaskType.HEAT: "Microwave", TaskType.COOL: "Fridge"}


class GoalConditions(NamedTuple):
    """How many conditions of a goal are met, and how many there are."""

    met: int
    total: int


def is_achieved(task: Task, room: SymbolicRoom, state: State) -> bool:
    """Return True if the goal of a task holds in a symbolic state."""
    if task.task_type == TaskType.EXAMINE:
        held = state.held is not None and room.types[state.held] == task.target
        return held and state.at in state.lit and room.types.get(state.at or "") == task.light
    if task.task_type == TaskType.PUT_AWAY and state.held is not None:
        return False
    return _n_placed(task, room, state) >= _n_required(task)


def goal_holds(task: Task, view: SimulatorView, treatments: Treatments | None = None) -> bool:
    """Return True if the goal of a task holds in the simulator.

    The conditions are ALFRED's, except that an `Apple` does not count as an `AppleSliced`, as it
    does in ALFRED's comparison of ids. Any object of the type will do, and any slice. A lamp must
    be lit and visible. PUT_AWAY is the published condition: the hand is empty, and an object of the
    type, whole or sliced, in such a receptacle.

    Args:
        task: the task.
        view: the current state of the simulator.
        treatments: the washed, heated and cooled objects. If None, they are unknown: then all
            objects count as treated, and lit lamps as visible.
    """
    room = room_of(view)
    everything = frozenset(room.types)
    treated = Treatments(everything, everything, everything) if treatments is None else treatments
    lamps = [key for key in sorted(room.start.lit) if room.types[key] == task.light]
    visible = [key for key in lamps if treatments is None or view.objects[key].visible]
    state = replace(
        room.start,
        at=next(iter(visible), None),
        clean=treated.clean,
        hot=treated.hot,
        cold=treated.cold,
    )
    return is_achieved(task, room, state)


def lower_bound(task: Task, room: SymbolicRoom, state: State) -> int:
    """Return a lower bound on the operators to the goal (admissible, for A*); 0 where it holds."""
    if is_achieved(task, room, state):
        return 0
    here = room.types.get(state.at or "")
    held = None if state.held is None else room.types[state.held]
    needed = _n_to_slice(task, room, state, held) + _n_to_treat(task, state, here)
    if task.task_type == TaskType.EXAMINE:
        return max(1, needed + (here != task.light) + (held != task.target))
    # Whatever completes the goal happens at its receptacle, so the agent must still go there.
    return max(1, needed + (here != task.receptacle) + _n_to_carry(task, room, state, held))


def _n_to_slice(task: Task, room: SymbolicRoom, state: State, held: str | None) -> int:
    """Return the operators that slicing needs: picking up a knife, and the cut."""
    is_cut = held == task.target or any(
        parent for item, parent in state.where if room.types[item] == task.target
    )
    return 0 if is_cut or not task.sliced else 1 + (held not in KNIVES)


def _n_to_treat(task: Task, state: State, here: str | None) -> int:
    """Return the operators of washing, heating or cooling: going to the appliance, and using it."""
    treated = _treated_items(task, state)
    return 0 if treated is None or treated else 1 + (here != APPLIANCE[task.task_type])


def _n_to_carry(task: Task, room: SymbolicRoom, state: State, held: str | None) -> int:
    """Return the pick-ups and puts needed; none for a sliced item, which may be sliced there."""
    if task.task_type == TaskType.STACK:
        where = dict(state.where)
        carriers = [item for item in where if room.types[item] == task.movable]
        there = any(room.types.get(where[item]) == task.receptacle for item in carriers)
        filled = task.sliced or any(
            room.types.get(parent) == task.movable
            for item, parent in state.where
            if room.types[item] == task.target
        )
        return (0 if there else 2 - (held == task.movable)) + (
            0 if filled else 2 - (held == task.target)
        )
    if task.sliced:
        return 0
    return 2 * (_n_required(task) - _n_placed(task, room, state)) - (held in task.targets)


def _n_required(task: Task) -> int:
    return 2 if task.task_type == TaskType.PLACE_TWO else 1


def _treated_items(task: Task, state: State) -> frozenset[str] | None:
    """Return the items with the treatment that the task requires, or None if it requires none."""
    return {TaskType.CLEAN: state.clean, TaskType.HEAT: state.hot, TaskType.COOL: state.cold}.get(
        task.task_type
    )


def _n_placed(task: Task, room: SymbolicRoom, state: State) -> int:
    """Return how many objects of the required type and treatment one right receptacle holds.

    They must be in the same receptacle: two objects on two side tables do not count as two on the
    side table.
    """
    where = dict(state.where) if task.task_type == TaskType.STACK else {}
    treated = _treated_items(task, state)
    targets = task.targets
    count = Counter[str]()
    for item, parent in state.where:
        if room.types[item] not in targets or (treated is not None and item not in treated):
            continue
        if task.task_type == TaskType.STACK:
            inside = room.types.get(parent) == task.movable
            count[parent] += inside and room.types.get(where.get(parent, "")) == task.receptacle
        else:
            count[parent] += room.types.get(parent) == task.receptacle
    return max(count.values(), default=0)


def goal_conditions(task: Task, view: SimulatorView, treatments: Treatments) -> GoalConditions:
    """Return the conditions of a task's goal now, given what was washed, heated and cooled.

    They are those of ALFRED's `goal_conditions_met` (`env/tasks.py`, Shridhar et al., CVPR 2020): a
    hot potato in the fridge is one in the fridge, a hot one, and one that is both. The goal holds
    where all are met.
    """
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
