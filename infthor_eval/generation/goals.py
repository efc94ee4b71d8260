"""When a task is done, in the symbolic state, and a lower bound on what is left to do."""

from infthor_eval.generation.symbolic import Room, State
from infthor_eval.generation.tasks import Task, TaskType

__all__ = ["achieved", "least_remaining"]


def achieved(task: Task, room: Room, state: State) -> bool:
    """Whether the goal of a task holds."""
    if task.kind == TaskType.EXAMINE:
        held = state.held is not None and room.types[state.held] == task.target
        return held and state.at in state.lit and room.types.get(state.at or "") == task.light
    return _placed(task, room, state) >= _wanted(task)


def least_remaining(task: Task, room: Room, state: State) -> int:
    """A number of operators that no plan from this state can do without (0 where the goal holds)."""
    if achieved(task, room, state):
        return 0
    if task.kind == TaskType.EXAMINE:
        right = state.held is not None and room.types[state.held] == task.target
        return 1 if right else 2
    missing = _wanted(task) - _placed(task, room, state)
    # Each missing object must be put, and picked up unless it is the one in the hand.
    carried = state.held is not None and room.types[state.held] in {task.target, task.movable}
    return 2 * missing - carried


def _wanted(task: Task) -> int:
    return 2 if task.kind == TaskType.PLACE_TWO else 1


def _placed(task: Task, room: Room, state: State) -> int:
    """How many objects of the asked kind, in the asked condition, are where they shall be."""
    where = dict(state.where)
    treated = {
        TaskType.CLEAN: state.clean,
        TaskType.HEAT: state.hot,
        TaskType.COOL: state.cold,
    }.get(task.kind)
    count = 0
    for item, parent in state.where:
        if room.types[item] != task.target or (treated is not None and item not in treated):
            continue
        if task.kind == TaskType.STACK:
            inside = room.types.get(parent) == task.movable
            count += inside and room.types.get(where.get(parent, "")) == task.receptacle
        else:
            count += room.types.get(parent) == task.receptacle
    return count
