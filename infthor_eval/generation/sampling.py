"""Which task comes next: sampled so that types, objects and receptacles stay diverse, from what the room can
do."""

import random
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
    goes_into,
)
from infthor_eval.household.symbolic import ABSENT, Room
from infthor_eval.household.tasks import Task, TaskType

__all__ = ["TaskPool", "tasks_of"]

_TREATED = {TaskType.CLEAN: CLEANABLE, TaskType.HEAT: HEATABLE, TaskType.COOL: COOLABLE}
_APPLIANCES = {TaskType.CLEAN: {"SinkBasin", "Faucet"}, TaskType.HEAT: {"Microwave"}, TaskType.COOL: {"Fridge"}}
_DOUBTED = 3  # failures that count: rooms change, and tasks that never failed must not crowd out the others
_LIGHT_LOADS = {"Pan", "Pot", "Plate", "Bowl", "Cup", "Mug", "Laptop", "Box", "Pillow"}  # too big to be stacked


class TaskPool:
    """Samples tasks; what was used or failed becomes less likely."""

    def __init__(self, kinds: Iterable[TaskType], rng: random.Random) -> None:
        """Begin with nothing used.

        Args:
            kinds: the task types to draw from.
            rng: makes the choices.
        """
        self._kinds = list(kinds)
        self._rng = rng
        self._used: Counter[str] = Counter()
        self._failed: Counter[Task] = Counter()

    def sample(self, room: Room, extra_types: Iterable[str] = ()) -> Iterator[Task]:
        """Tasks for a room as it is now, in random order, the fresher ones earlier.

        Args:
            room: as it is now.
            extra_types: types of what the room has beside items and places (faucets).
        """
        kinds = set(self._kinds)
        found = [task for task in tasks_of(room, extra_types) if task.kind in kinds]
        # Efraimidis and Spirakis: sorting by u ** (1 / weight) is weighted sampling without replacement. In its
        # logarithm, as the power itself is 0 for all tasks alike once weights are small.
        share = Counter(task.kind for task in found)
        waits = {task: self._rng.expovariate(self._weight(task) / share[task.kind]) for task in found}
        yield from sorted(found, key=lambda task: waits[task])

    def used(self, task: Task) -> None:
        """Note that a task became part of the trajectory."""
        self._used.update(_aspects(task))

    def failed(self, task: Task) -> None:
        """Note that a task was tried and did not work."""
        self._failed[task] += 1

    def _weight(self, task: Task) -> float:
        weight = 0.5 ** min(self._failed[task], _DOUBTED)
        for aspect in _aspects(task):
            weight /= 1 + self._used[aspect]
        return weight


def tasks_of(room: Room, extra_types: Iterable[str] = ()) -> list[Task]:
    """Every task that the room has the objects for, in a fixed order."""
    where = dict(room.start.where)
    here = {room.types[item] for item, parent in where.items() if parent != ABSENT or item == room.start.held}
    furniture = {room.types[place] for place in room.places & room.receptacles}
    lamps = {room.types[lamp] for lamp in room.places - room.start.lit if room.types[lamp] in LIGHTS}
    known = here | furniture | set(extra_types)
    count = Counter(room.types[item] for item, parent in where.items() if parent != ABSENT)
    tasks: list[Task] = []
    for pickup in sorted(here):
        for sliced in (False, True) if _can_be_sliced(pickup, here) else (False,):
            tasks += [Task(TaskType.EXAMINE, pickup, light=lamp, sliced=sliced) for lamp in sorted(lamps)]
            for receptacle in sorted(furniture):
                if goes_into(pickup, receptacle):
                    tasks += _placements(pickup, receptacle, sliced, known, here, count)
    return [task for task in tasks if not task.pickup.endswith("Sliced")]


def _can_be_sliced(pickup: str, here: set[str]) -> bool:
    return pickup in SLICEABLE and bool(KNIVES & here)


def _placements(
    pickup: str, receptacle: str, sliced: bool, known: set[str], here: set[str], count: Counter[str]
) -> Iterator[Task]:
    yield Task(TaskType.PLACE, pickup, receptacle, sliced=sliced)
    if sliced or count[pickup] > 1:
        yield Task(TaskType.PLACE_TWO, pickup, receptacle, sliced=sliced)
    for kind, types in _TREATED.items():
        if pickup in types and known >= _APPLIANCES[kind] and receptacle not in _APPLIANCES[kind]:
            yield Task(kind, pickup, receptacle, sliced=sliced)
    if pickup in _LIGHT_LOADS:
        return
    for movable in sorted(MOVABLE_RECEPTACLES & here - {pickup}):
        if goes_into(pickup, movable) and goes_into(movable, receptacle):
            yield Task(TaskType.STACK, pickup, receptacle, movable=movable, sliced=sliced)


def _aspects(task: Task) -> list[str]:
    """What of a task shall not recur too often."""
    receptacle = task.receptacle or task.light
    return [f"kind {task.kind} {task.sliced}", f"pickup {task.pickup}", f"to {receptacle}", str(task)]
