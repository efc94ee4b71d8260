"""A room as the planner sees it: where items are, what was done to them, and where the agent is.

A *place* is what the agent can go to: a piece of furniture, a lamp, or an item on the floor. An
*item* can be carried. Slices are items that start to exist when the whole is sliced; every task
needs at most two. Opening and closing are not modelled: the rollout adds them where they are
needed, as ALFRED does.
"""

from collections.abc import Container, Iterable
from dataclasses import dataclass
from functools import cached_property

from infthor_eval.grouping import grouped
from infthor_eval.household.affordances import SLICEABLE, goes_into
from infthor_eval.household.containment import direct_parent
from infthor_eval.thor.view import SimulatorView, ThorObject

ABSENT = ""  # parent of an item that is held, or does not exist yet or any more
FLOOR = "floor"
_SLICES = 2


@dataclass(frozen=True)
class Operator:
    """One step of a plan: ALFRED's sub-goal name, the object, and for PutObject the receptacle."""

    name: str
    item: str
    receptacle: str | None = None


@dataclass(frozen=True)
class State:
    """What operators change.

    Attributes:
        at: id of the place where the agent is, or None.
        held: id of the held item, or None.
        where: (item, parent) pairs of ids in a fixed order, as states are compared and hashed.
        clean: items that were washed in this task.
        hot: items that were heated in this task and not cooled since.
        cold: items that were cooled in this task and not heated since.
        lit: lamps that are on.
    """

    at: str | None
    held: str | None
    where: tuple[tuple[str, str], ...]
    clean: frozenset[str] = frozenset()
    hot: frozenset[str] = frozenset()
    cold: frozenset[str] = frozenset()
    lit: frozenset[str] = frozenset()


@dataclass(frozen=True)
class SymbolicRoom:
    """What operators do not change, and the initial state.

    Attributes:
        types: types of the items, receptacles and lamps, by id.
        places: ids of the furniture and lamps.
        receptacles: ids of the receptacles, including items (plates).
        start: the initial state.
        refused: (item, receptacle) pairs that are known not to fit.
    """

    types: dict[str, str]
    places: frozenset[str]
    receptacles: frozenset[str]
    start: State
    refused: frozenset[tuple[str, str]] = frozenset()

    @cached_property
    def items(self) -> dict[str, list[str]]:
        """Ids of the items by their type."""
        return grouped((self.types[item], item) for item, _ in self.start.where)

    def place_of(self, item: str, where: dict[str, str]) -> str | None:
        """Return where an item or receptacle can be reached, or None if it is held or absent."""
        seen = set()  # in case objects are reported to be inside each other
        while item not in self.places:
            if item in seen or item not in where or where[item] == ABSENT:
                return None
            seen.add(item)
            if where[item] == FLOOR:
                return item
            item = where[item]
        return item

    def fits(self, item: str, receptacle: str) -> bool:
        """Return True if a receptacle is made for an item's type and not known to be full."""
        usual = receptacle in self.receptacles and goes_into(
            self.types[item], self.types[receptacle]
        )
        return usual and (item, receptacle) not in self.refused


def room_of(
    view: SimulatorView, blocked: Container[str] = (), refused: Iterable[tuple[str, str]] = ()
) -> SymbolicRoom:
    """Read a room from the simulator's state, with the agent at no place; `blocked` objects cannot
    be acted on."""
    objects = {key: obj for key, obj in view.objects.items() if not _is_remains(obj)}
    items = {key: obj for key, obj in objects.items() if obj.pickupable and key not in blocked}
    places = {key for key, obj in objects.items() if _is_place(obj)}
    where = {key: _parent_of(obj, objects, places) for key, obj in items.items()}
    types = {key: obj.object_type for key, obj in objects.items() if key in places or key in items}
    for key, obj in items.items():
        if obj.object_type in SLICEABLE:
            for number in range(1, _SLICES + 1):
                where[slice_item(key, number)] = ABSENT
                types[slice_item(key, number)] = f"{obj.object_type}Sliced"
    held = next((key for key in view.inventory if key in items), None)
    return SymbolicRoom(
        types=types,
        places=frozenset(places),
        receptacles=frozenset(
            key
            for key in types
            if key in objects and objects[key].receptacle and key not in blocked
        ),
        start=State(
            at=None,
            held=held,
            where=tuple(sorted(where.items())),
            lit=frozenset(
                key for key in places if objects[key].toggleable and objects[key].is_toggled
            ),
        ),
        refused=frozenset(refused),
    )


def slice_item(whole: str, number: int) -> str:
    """Return the id of a slice that does not exist yet."""
    return f"{whole}#{number}"


def _parent_of(obj: ThorObject, objects: dict[str, ThorObject], places: Iterable[str]) -> str:
    if obj.is_picked_up:
        return ABSENT
    parent = direct_parent(obj, objects)
    return (
        parent if parent is not None and (parent in places or objects[parent].pickupable) else FLOOR
    )


def _is_remains(obj: ThorObject) -> bool:
    """Return True for what sliced or broken objects leave in the metadata."""
    return obj.is_broken or (obj.is_sliced and not obj.object_type.endswith("Sliced"))


def _is_place(obj: ThorObject) -> bool:
    furniture = obj.receptacle and obj.object_type != "Floor"
    lamp = obj.toggleable and obj.object_type.endswith("Lamp")
    return not obj.pickupable and bool(furniture or lamp)
