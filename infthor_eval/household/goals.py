"""When a task is done, in the symbolic state, and a lower bound on what is left to do."""

from collections import Counter
from dataclasses import replace

from infthor_eval.household.affordances import KNIVES
from infthor_eval.household.symbolic import State, SymbolicRoom, room_of
from infthor_eval.household.tasks import Task, TaskType
from infthor_eval.household.treatments import Treatments
from infthor_eval.thor.view import SimulatorView

__all__ = ["APPLIANCE", "goal_holds", "is_achieved", "lower_bound"]

APPLIANCE = {TaskType.CLEAN: "SinkBasin", TaskType.HEAT: "Microwave", TaskType.COOL: "Fridge"}


def is_achieved(task: Task, room: SymbolicRoom, state: State) -> bool:
    """Whether the goal of a task holds."""
    if task.task_type == TaskType.EXAMINE:
        held = state.held is not None and room.types[state.held] == task.target
        return held and state.at in state.lit and room.types.get(state.at or "") == task.light
    return _placed(task, room, state) >= _wanted(task)


def goal_holds(task: Task, view: SimulatorView, treatments: Treatments | None = None) -> bool:
    """Whether the goal of a task holds in what the simulator reports.

    The conditions are ALFRED's, but for names: an `Apple` is no `AppleSliced`, which ALFRED's comparison of ids takes
    it for. Which object of a type it is, or which slice, does not matter. A lamp must be lit and visible.

    Args:
        task: the task.
        view: the world now.
        treatments: what was washed, heated and cooled; None where only the view is known: then everything counts as
            treated, and a lit lamp as visible from where the agent was to go.
    """
    room = room_of(view)
    everything = frozenset(room.types)
    known = Treatments(everything, everything, everything) if treatments is None else treatments
    lamps = [key for key in sorted(room.start.lit) if room.types[key] == task.light]
    seen = [key for key in lamps if treatments is None or view.objects[key].visible]
    state = replace(room.start, at=next(iter(seen), None), clean=known.clean, hot=known.hot, cold=known.cold)
    return is_achieved(task, room, state)


def lower_bound(task: Task, room: SymbolicRoom, state: State) -> int:
    """A number of operators that no plan from this state can do without; 0 just where the goal holds."""
    if is_achieved(task, room, state):
        return 0
    here = room.types.get(state.at or "")
    held = None if state.held is None else room.types[state.held]
    needed = _to_slice(task, room, state, held) + _to_treat(task, state, here)
    if task.task_type == TaskType.EXAMINE:
        return max(1, needed + (here != task.light) + (held != task.target))
    # Whatever completes the goal happens at its receptacle.
    return max(1, needed + (here != task.receptacle) + _to_carry(task, room, state, held))


def _to_slice(task: Task, room: SymbolicRoom, state: State, held: str | None) -> int:
    """What slicing still needs: the knife in the hand and the cut."""
    if not task.sliced or any(parent for item, parent in state.where if room.types[item] == task.target):
        return 0
    in_hand = held == task.target
    return 0 if in_hand else 1 + (held not in KNIVES)


def _to_treat(task: Task, state: State, here: str | None) -> int:
    """What washing, heating or cooling still needs: going there and doing it."""
    treated = {TaskType.CLEAN: state.clean, TaskType.HEAT: state.hot, TaskType.COOL: state.cold}.get(task.task_type)
    return 0 if treated is None or treated else 1 + (here != APPLIANCE[task.task_type])


def _to_carry(task: Task, room: SymbolicRoom, state: State, held: str | None) -> int:
    """The pick-ups and puts still needed; what is sliced where it shall be needs none."""
    if task.task_type == TaskType.STACK:
        where = dict(state.where)
        carriers = [item for item in where if room.types[item] == task.movable]
        there = any(room.types.get(where[item]) == task.receptacle for item in carriers)
        filled = task.sliced or any(
            room.types.get(parent) == task.movable for item, parent in state.where if room.types[item] == task.target
        )
        return (0 if there else 2 - (held == task.movable)) + (0 if filled else 2 - (held == task.target))
    if task.sliced:
        return 0
    return 2 * (_wanted(task) - _placed(task, room, state)) - (held == task.target)


def _wanted(task: Task) -> int:
    return 2 if task.task_type == TaskType.PLACE_TWO else 1


def _placed(task: Task, room: SymbolicRoom, state: State) -> int:
    """How many objects of the asked type, in the asked condition, are together where they shall be.

    Together is in one and the same receptacle: two objects on two side tables are not two on the side table.
    """
    where = dict(state.where)
    treated = {
        TaskType.CLEAN: state.clean,
        TaskType.HEAT: state.hot,
        TaskType.COOL: state.cold,
    }.get(task.task_type)
    count = Counter[str]()
    for item, parent in state.where:
        if room.types[item] != task.target or (treated is not None and item not in treated):
            continue
        if task.task_type == TaskType.STACK:
            inside = room.types.get(parent) == task.movable
            count[parent] += inside and room.types.get(where.get(parent, "")) == task.receptacle
        else:
            count[parent] += room.types.get(parent) == task.receptacle
    return max(count.values(), default=0)
