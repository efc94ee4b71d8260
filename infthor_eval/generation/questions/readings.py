"""Whether "the objects in or on" a receptacle are unambiguous.

On a counter top, do the objects in a pan count, and does the toaster? Table 3's forms do not define
it, so they are used only where every reading gives the same answer. Our further forms define it:
objects that can be picked up and are directly there.
"""

import math
from collections.abc import Iterable

from infthor_eval.generation.questions.history import TrajectoryHistory

__all__ = ["can_be_picked_up", "is_plain"]

_TOPS = frozenset(
    {
        "CoffeeTable",
        "Desk",
        "DiningTable",
        "Dresser",
        "Shelf",
        "ShelvingUnit",
        "SideTable",
        "TVStand",
    }
)
_COUNTER = "CounterTop"  # so long that the distance from its middle means little
_FIXTURES = frozenset(
    {
        "CoffeeMachine",
        "DeskLamp",
        "Desktop",
        "Faucet",
        "HousePlant",
        "Microwave",
        "RoomDecor",
        "Sink",
        "StoveBurner",
    }
    | {"TableTopDecor", "Television", "Toaster"}
)
_SPAN = 1.5  # maximum distance from the middle of a table to an object on it, metres


def can_be_picked_up(
    history: TrajectoryHistory, frame: int, keys: Iterable[str]
) -> frozenset[str] | None:
    """Return the objects that can be picked up, or None if the log does not report this for one of
    them."""
    states = history.states(frame)
    types = {key: states[key].type for key in keys}
    if not history.reported_types.issuperset(types.values()):
        return None
    return frozenset(
        key for key, object_type in types.items() if object_type in history.pickupable_types
    )


def is_plain(history: TrajectoryHistory, frame: int, place: str) -> bool:
    """Return True if a receptacle holds only objects that can be picked up, all empty, and has no
    fixture on it."""
    inside = history.contents(frame, place)
    loose = can_be_picked_up(history, frame, inside) == inside
    nested = any(history.contents(frame, key) for key in inside)
    return loose and not nested and not _has_fixtures(history, frame, place)


def _has_fixtures(history: TrajectoryHistory, frame: int, place: str) -> bool:
    states = history.states(frame)
    fixtures = [state.position for state in states.values() if state.type in _FIXTURES]
    if states[place].type == _COUNTER:
        return bool(fixtures)
    x, _, z = states[place].position
    near = (math.hypot(other[0] - x, other[2] - z) <= _SPAN for other in fixtures)
    return states[place].type in _TOPS and any(near)
