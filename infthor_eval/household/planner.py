"""Optimal plans, with the fewest sub-goals, by A* over symbolic states.

The search is reduced to what can matter, and plans stay optimal. Every operator costs one, so all
places are equivalent that are not part of the task (not the source of a needed item, not a goal,
not a needed sink, microwave, fridge or lamp). Each item that may have to be put aside needs only
one of these.
"""

import heapq
import itertools
from collections.abc import Iterator
from dataclasses import replace

from infthor_eval.household.affordances import KNIVES
from infthor_eval.household.goals import APPLIANCE, lower_bound
from infthor_eval.household.symbolic import ABSENT, FLOOR, Operator, State, SymbolicRoom, slice_item
from infthor_eval.household.tasks import Task, TaskType

# States of a search; the hardest of the solvable problems tried needed a quarter of it.
_LIMIT = 60_000


def plan(task: Task, room: SymbolicRoom) -> list[Operator] | None:
    """Return the shortest plan for a task: empty if its goal holds now, None if there is none."""
    if not is_feasible(task, room):
        return None
    problem = _Problem(task, room)
    start = problem.start
    # Ties are broken by the order of insertion: states are not ordered, and plans must not depend
    # on hashes.
    order = itertools.count()
    queue = [(lower_bound(task, room, start), next(order), 0, start)]
    previous: dict[State, tuple[State, Operator] | None] = {start: None}
    cost = {start: 0}
    while queue and len(previous) < _LIMIT:
        bound, _, spent, state = heapq.heappop(queue)
        if spent > cost[state]:  # an outdated entry: the state was reached at a lower cost since
            continue
        if bound == spent:  # `lower_bound` is 0 only at goals
            return _trace(previous, state)
        for operator, following in problem.successors(state):
            if spent + 1 < cost.get(following, _LIMIT):
                cost[following] = spent + 1
                previous[following] = (state, operator)
                bound = spent + 1 + lower_bound(task, room, following)
                heapq.heappush(queue, (bound, next(order), spent + 1, following))
    return None


def is_feasible(task: Task, room: SymbolicRoom) -> bool:
    """Return False if no item fits any goal receptacle, or any movable one that must go there.

    Without this check the search would run to its limit.
    """
    if task.receptacle is None:
        return True
    items = _items_of_types(room, {task.pickup, *task.targets})
    goals = [key for key in room.receptacles if room.types[key] == task.receptacle]
    if task.movable is None:
        return _any_fits(room, items, goals)
    carriers = _items_of_types(room, {task.movable})
    return _any_fits(room, items, carriers) and _any_fits(room, carriers, goals)


def _items_of_types(room: SymbolicRoom, types: set[str | None]) -> list[str]:
    return [item for name in types if name is not None for item in room.items.get(name, ())]


def _any_fits(room: SymbolicRoom, items: list[str], receptacles: list[str]) -> bool:
    return any(
        (item, receptacle) not in room.refused for item in items for receptacle in receptacles
    )


def relevant_items(task: Task, room: SymbolicRoom) -> set[str]:
    """Return the ids of items of the task's types, knives if it slices, and what holds these."""
    types = {task.pickup, *task.targets, task.movable} | (set(KNIVES) if task.sliced else set())
    where = dict(room.start.where)
    relevant = {item for item in where if room.types[item] in types or item == room.start.held}
    if task.sliced:
        relevant |= {
            slice_item(item, number)
            for item in relevant
            if slice_item(item, 1) in where
            for number in (1, 2)
        }
    # What these items are in can itself be carried (a mug on a plate), so its place must be known.
    for item in list(relevant):
        while (item := where.get(item, ABSENT)) in where:
            relevant.add(item)
    return relevant


def _trace(previous: dict[State, tuple[State, Operator] | None], state: State) -> list[Operator]:
    operators: list[Operator] = []
    while (step := previous[state]) is not None:
        operators.append(step[1])
        state = step[0]
    return operators[::-1]


class _Problem:
    """One task in one room, reduced to the relevant items and places."""

    def __init__(self, task: Task, room: SymbolicRoom) -> None:
        self._task = task
        self._room = room
        where = dict(room.start.where)
        relevant = relevant_items(task, room)
        self.start = replace(
            room.start,
            where=tuple((item, parent) for item, parent in room.start.where if item in relevant),
            clean=room.start.clean & relevant,
            hot=room.start.hot & relevant,
            cold=room.start.cold & relevant,
        )
        self._movables = [item for item in sorted(relevant) if room.types[item] == task.movable]
        self._targets = self._relevant_places(relevant, where)

    def successors(self, state: State) -> Iterator[tuple[Operator, State]]:
        """Yield the applicable operators with the states that they lead to."""
        where = dict(state.where)
        yield from self._gotos(state, where)
        if state.held is None:
            yield from self._pickups(state, where)
        else:
            yield from self._puts(state, where, state.held)
            yield from self._treatments(state, where, state.held)
        if (
            state.at is not None
            and self._room.types[state.at] == self._task.light
            and state.at not in state.lit
        ):
            yield Operator("ToggleObject", state.at), replace(state, lit=state.lit | {state.at})

    def _relevant_places(self, items: set[str], where: dict[str, str]) -> list[str]:
        room = self._room
        task = self._task
        types = {task.receptacle, task.light, APPLIANCE.get(task.task_type)}
        needed = {place for place in room.places if room.types[place] in types}
        needed |= {
            place
            for item in items
            if (place := room.place_of(item, where)) in room.places and place
        }
        spare = set()  # one place per item to put it aside, see the module's docstring
        for item in sorted(items):
            others = [place for place in sorted(room.places - needed) if room.fits(item, place)]
            spare |= set(others[:1])
        return sorted(needed | spare)

    def _gotos(self, state: State, where: dict[str, str]) -> Iterator[tuple[Operator, State]]:
        loose = [item for item, parent in where.items() if parent == FLOOR]
        for place in itertools.chain(self._targets, loose):
            if place != state.at:
                yield Operator("GotoLocation", place), replace(state, at=place)

    def _pickups(self, state: State, where: dict[str, str]) -> Iterator[tuple[Operator, State]]:
        for item, parent in where.items():
            if parent != ABSENT and self._room.place_of(item, where) == state.at:
                yield Operator("PickupObject", item), _move(state, item, ABSENT, held=item)

    def _puts(
        self, state: State, where: dict[str, str], held: str
    ) -> Iterator[tuple[Operator, State]]:
        for receptacle in itertools.chain((state.at,), self._movables):
            if receptacle is None or receptacle == held or not self._room.fits(held, receptacle):
                continue
            if self._room.place_of(receptacle, where) == state.at:
                yield (
                    Operator("PutObject", held, receptacle),
                    _move(state, held, receptacle, held=None),
                )

    def _treatments(
        self, state: State, where: dict[str, str], held: str
    ) -> Iterator[tuple[Operator, State]]:
        at = self._room.types.get(state.at or "")
        if (
            at == APPLIANCE.get(self._task.task_type)
            and self._room.types[held] == self._task.target
        ):
            if self._task.task_type == TaskType.CLEAN and held not in state.clean:
                yield (
                    Operator("CleanObject", held, state.at),
                    replace(state, clean=state.clean | {held}),
                )
            if self._task.task_type == TaskType.HEAT and held not in state.hot:
                after = replace(state, hot=state.hot | {held}, cold=state.cold - {held})
                yield Operator("HeatObject", held, state.at), after
            if self._task.task_type == TaskType.COOL and held not in state.cold:
                after = replace(state, cold=state.cold | {held}, hot=state.hot - {held})
                yield Operator("CoolObject", held, state.at), after
        if self._task.sliced and self._room.types[held] in KNIVES:
            yield from self._slicings(state, where)

    def _slicings(self, state: State, where: dict[str, str]) -> Iterator[tuple[Operator, State]]:
        for item, parent in where.items():
            whole = self._room.types[item] == self._task.pickup and parent != ABSENT
            if (
                whole
                and slice_item(item, 1) in where
                and self._room.place_of(item, where) == state.at
            ):
                slices = {key: parent for key in where if key.startswith(f"{item}#")}
                after = replace(
                    state, where=tuple((key, slices.get(key, old)) for key, old in state.where)
                )
                yield Operator("SliceObject", item), _move(after, item, ABSENT, held=state.held)


def _move(state: State, item: str, parent: str, held: str | None) -> State:
    where = tuple((key, parent if key == item else old) for key, old in state.where)
    return replace(state, where=where, held=held)
