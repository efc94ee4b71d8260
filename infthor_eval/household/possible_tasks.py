"""The tasks that are possible with the objects of a room, and those that its type usually has."""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator

from infthor_eval.household import affordances
from infthor_eval.household.affordances import (
    GOALS_BY_ROOM,
    KNIVES,
    LIGHTS,
    MOVABLE_RECEPTACLES,
    SLICEABLE,
    STOWABLE,
    goes_into,
)
from infthor_eval.household.goals import is_achieved
from infthor_eval.household.planner import is_feasible
from infthor_eval.household.symbolic import ABSENT, SymbolicRoom
from infthor_eval.household.tasks import SAMPLED, Task, TaskType
from infthor_eval.scene_types import scene_type

_TREATED = {
    TaskType.CLEAN: affordances.CLEANABLE,
    TaskType.HEAT: affordances.HEATABLE,
    TaskType.COOL: affordances.COOLABLE,
}
_APPLIANCES = {
    TaskType.CLEAN: {"SinkBasin", "Faucet"},
    TaskType.HEAT: {"Microwave"},
    TaskType.COOL: {"Fridge"},
}
_NOT_FOR_TWO = {"CoffeeMachine", "HandTowelHolder", "ToiletPaperHanger"}  # as published


def usual_tasks(scene: str) -> frozenset[TaskType]:
    """Return the task types drawn from in a scene's room type, or all if that is unknown."""
    room = scene_type(scene)
    return frozenset(name for name in SAMPLED if room is None or room in GOALS_BY_ROOM[name])


def open_tasks(
    room: SymbolicRoom, extra_types: Iterable[str], task_types: Collection[TaskType]
) -> list[Task]:
    """Return the tasks of some types that a next task is drawn from: possible, and not done yet.

    The order and `extra_types` are those of `tasks_of`.
    """
    tasks = (task for task in tasks_of(room, extra_types) if task.task_type in task_types)
    return [
        task
        for task in tasks
        if is_feasible(task, room) and not is_achieved(task, room, room.start)
    ]


def tasks_of(room: SymbolicRoom, extra_types: Iterable[str] = ()) -> list[Task]:
    """Return all tasks possible with a room's objects, in a fixed order, for seeded sampling.

    `extra_types` are the types of the objects that are neither items nor places (faucets).
    """
    where = dict(room.start.where)
    movable_types = {
        room.types[item]
        for item, parent in where.items()
        if parent != ABSENT or item == room.start.held
    }
    furniture = {room.types[key] for key in room.places & room.receptacles}
    lamps = {
        room.types[lamp] for lamp in room.places - room.start.lit if room.types[lamp] in LIGHTS
    }
    known = movable_types | furniture | set(extra_types)
    count = Counter(room.types[item] for item, parent in where.items() if parent != ABSENT)
    tasks: list[Task] = []
    for pickup in sorted(movable_types & STOWABLE):
        for sliced in (False, True) if pickup in SLICEABLE and KNIVES & movable_types else (False,):
            tasks += [
                Task(TaskType.EXAMINE, pickup, light=lamp, sliced=sliced) for lamp in sorted(lamps)
            ]
            for receptacle in sorted(furniture):
                if goes_into(f"{pickup}Sliced" if sliced else pickup, receptacle):
                    tasks += _placements(pickup, receptacle, sliced, known, movable_types, count)
    return [task for task in tasks if not task.pickup.endswith("Sliced")]


def _placements(
    pickup: str,
    receptacle: str,
    sliced: bool,
    known: set[str],
    movable_types: set[str],
    count: Counter[str],
) -> Iterator[Task]:
    task = Task(TaskType.PLACE, pickup, receptacle, sliced=sliced)
    target = task.target
    yield task
    if (sliced or count[pickup] > 1) and receptacle not in _NOT_FOR_TWO:
        yield Task(TaskType.PLACE_TWO, pickup, receptacle, sliced=sliced)
    for task_type, types in _TREATED.items():
        if (
            target in types
            and known >= _APPLIANCES[task_type]
            and receptacle not in _APPLIANCES[task_type]
        ):
            yield Task(task_type, pickup, receptacle, sliced=sliced)
    for movable in sorted(MOVABLE_RECEPTACLES & movable_types - {pickup}):
        if goes_into(target, movable) and goes_into(movable, receptacle):
            yield Task(TaskType.STACK, pickup, receptacle, movable=movable, sliced=sliced)
