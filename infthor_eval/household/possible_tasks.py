"""The tasks that a room has the objects for."""

from collections import Counter
from collections.abc import Iterable, Iterator

from infthor_eval.household.affordances import (
    CLEANABLE,
    COOLABLE,
    HEATABLE,
    KNIVES,
    LIGHTS,
    MOVABLE_RECEPTACLES,
    SLICEABLE,
    STOWABLE,
    goes_into,
)
from infthor_eval.household.symbolic import ABSENT, SymbolicRoom
from infthor_eval.household.tasks import Task, TaskType

__all__ = ["tasks_of"]

_TREATED = {TaskType.CLEAN: CLEANABLE, TaskType.HEAT: HEATABLE, TaskType.COOL: COOLABLE}
_APPLIANCES = {TaskType.CLEAN: {"SinkBasin", "Faucet"}, TaskType.HEAT: {"Microwave"}, TaskType.COOL: {"Fridge"}}


def tasks_of(room: SymbolicRoom, extra_types: Iterable[str] = ()) -> list[Task]:
    """Every task that the room has the objects for, in a fixed order."""
    where = dict(room.start.where)
    here = {room.types[item] for item, parent in where.items() if parent != ABSENT or item == room.start.held}
    furniture = {room.types[place] for place in room.places & room.receptacles}
    lamps = {room.types[lamp] for lamp in room.places - room.start.lit if room.types[lamp] in LIGHTS}
    known = here | furniture | set(extra_types)
    count = Counter(room.types[item] for item, parent in where.items() if parent != ABSENT)
    tasks: list[Task] = []
    for pickup in sorted(here & STOWABLE):
        for sliced in (False, True) if _can_be_sliced(pickup, here) else (False,):
            tasks += [Task(TaskType.EXAMINE, pickup, light=lamp, sliced=sliced) for lamp in sorted(lamps)]
            for receptacle in sorted(furniture):
                if goes_into(f"{pickup}Sliced" if sliced else pickup, receptacle):
                    tasks += _placements(pickup, receptacle, sliced, known, here, count)
    return [task for task in tasks if not task.pickup.endswith("Sliced")]


def _can_be_sliced(pickup: str, here: set[str]) -> bool:
    return pickup in SLICEABLE and bool(KNIVES & here)


def _placements(
    pickup: str, receptacle: str, sliced: bool, known: set[str], here: set[str], count: Counter[str]
) -> Iterator[Task]:
    task = Task(TaskType.PLACE, pickup, receptacle, sliced=sliced)
    target = task.target
    yield task
    if sliced or count[pickup] > 1:
        yield Task(TaskType.PLACE_TWO, pickup, receptacle, sliced=sliced)
    for task_type, types in _TREATED.items():
        if target in types and known >= _APPLIANCES[task_type] and receptacle not in _APPLIANCES[task_type]:
            yield Task(task_type, pickup, receptacle, sliced=sliced)
    for movable in sorted(MOVABLE_RECEPTACLES & here - {pickup}):
        if goes_into(target, movable) and goes_into(movable, receptacle):
            yield Task(TaskType.STACK, pickup, receptacle, movable=movable, sliced=sliced)
