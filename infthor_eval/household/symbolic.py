"""A room as the planner sees it: which thing is where, what was done to it, where the agent stands.

A *place* is what the agent walks to: a piece of furniture, a lamp, or a thing that lies on the floor. An
*item* is what can be carried. Slices are items of their own that come into being when the whole is sliced;
two of them are enough for every task. Opening and closing are not modelled: the rollout adds them around what
needs them, as ALFRED does.
"""

from collections.abc import Container, Iterable
from dataclasses import dataclass

from infthor_eval.household.affordances import SLICEABLE
from infthor_eval.household.containment import direct_parent
from infthor_eval.thor.view import SimulatorView, ThorObject

__all__ = ["ABSENT", "FLOOR", "Operator", "State", "SymbolicRoom", "room_of", "slice_item"]

ABSENT = ""  # where an item is that does not exist yet, or no longer
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
    """What operators change. `where` maps an item to the id of what it is in or on; a held item has none.

    Attributes:
        at: the place where the agent stands, or None.
        held: the item in its hand, or None.
        where: (item, parent id) pairs in a fixed order.
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
    """What operators do not change.

    Attributes:
        types: type of every item, receptacle and lamp, by id.
        places: ids of the furniture and lamps.
        receptacles: ids of what things can be put into or onto, items among them.
        start: the state now.
        refused: (item, receptacle) pairs of which it is known that the one finds no room in the other.
    """

    types: dict[str, str]
    places: frozenset[str]
    receptacles: frozenset[str]
    start: State
    refused: frozenset[tuple[str, str]] = frozenset()

    def place_of(self, item: str, where: dict[str, str]) -> str | None:
        """The place at which an item, or a receptacle, can be reached; None where it does not exist or is
        held."""
        seen = set()
        while item not in self.places:
            if item in seen or item not in where or where[item] == ABSENT:
                return None
            seen.add(item)
            if where[item] == FLOOR:
                return item
            item = where[item]
        return item


def room_of(view: SimulatorView, blocked: Container[str] = (), refused: Iterable[tuple[str, str]] = ()) -> SymbolicRoom:
    """Read a room from what the simulator reports. The agent counts as being at no place.

    Args:
        view: the world now.
        blocked: ids of objects that cannot be acted on as things are: not picked up, or not put into.
        refused: as `Room.refused`.
    """
    objects = {key: item for key, item in view.objects.items() if not _is_remains(item)}
    items = {key: item for key, item in objects.items() if item.pickupable and key not in blocked}
    places = {key for key, item in objects.items() if _is_place(item)}
    where = {key: _whereabouts(item, objects, places) for key, item in items.items()}
    types = {key: item.object_type for key, item in objects.items() if key in places or key in items}
    for key, item in items.items():
        if item.object_type in SLICEABLE:
            for number in range(1, _SLICES + 1):
                where[slice_item(key, number)] = ABSENT
                types[slice_item(key, number)] = f"{item.object_type}Sliced"
    held = next((key for key in view.inventory if key in items), None)
    return SymbolicRoom(
        types=types,
        places=frozenset(places),
        receptacles=frozenset(
            key for key in types if key in objects and objects[key].receptacle and key not in blocked
        ),
        start=State(
            at=None,
            held=held,
            where=tuple(sorted(where.items())),
            lit=frozenset(key for key in places if objects[key].toggleable and objects[key].is_toggled),
        ),
        refused=frozenset(refused),
    )


def slice_item(whole: str, number: int) -> str:
    """Name of a slice that does not exist yet."""
    return f"{whole}#{number}"


def _whereabouts(item: ThorObject, objects: dict[str, ThorObject], places: Iterable[str]) -> str:
    if item.is_picked_up:
        return ABSENT
    parent = direct_parent(item, objects)
    known = parent is not None and (parent in places or objects[parent].pickupable)
    return parent if known and parent is not None else FLOOR


def _is_remains(item: ThorObject) -> bool:
    """Whether it is what sliced or broken things leave in the metadata."""
    return item.is_broken or (item.is_sliced and not item.object_type.endswith("Sliced"))


def _is_place(item: ThorObject) -> bool:
    furniture = item.receptacle and item.object_type != "Floor"
    lamp = item.toggleable and item.object_type.endswith("Lamp")
    return not item.pickupable and (furniture or lamp)
