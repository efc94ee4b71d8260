"""What "the objects in or on" something are, where people could read that differently.

A counter top has things on it, and in the pan there; does the toaster count that stands there? Table 3's forms do not
say, so they are asked only where every reading gives the same list. Our further forms do say: what can be picked up,
and is directly there.
"""

import math
from collections.abc import Iterable

from infthor_eval.generation.questions.history import TrajectoryHistory

__all__ = ["can_be_picked_up", "is_plain"]

_TOPS = frozenset({"CoffeeTable", "Desk", "DiningTable", "Dresser", "Shelf", "ShelvingUnit", "SideTable", "TVStand"})
_COUNTER = "CounterTop"  # so long that where its middle is says little
_FIXTURES = frozenset(
    {"CoffeeMachine", "DeskLamp", "Desktop", "Faucet", "HousePlant", "Microwave", "RoomDecor", "Sink", "StoveBurner"}
    | {"TableTopDecor", "Television", "Toaster"}
)
_SPAN = 1.5  # metres from the middle of a table within which something may stand on it


def can_be_picked_up(history: TrajectoryHistory, frame: int, keys: Iterable[str]) -> frozenset[str] | None:
    """Those of some objects that can be picked up; None where the log never tells of one of them."""
    world = history.world(frame)
    types = {key: world[key].type for key in keys}
    if not history.types_told.issuperset(types.values()):
        return None
    return frozenset(key for key, object_type in types.items() if object_type in history.types_picked_up)


def is_plain(history: TrajectoryHistory, frame: int, place: str) -> bool:
    """Whether a receptacle holds nothing but loose objects, themselves empty, and no fixture stands on it."""
    inside = history.contents(frame, place)
    loose = can_be_picked_up(history, frame, inside) == inside
    nested = any(history.contents(frame, key) for key in inside)
    return loose and not nested and not _bears_fixtures(history, frame, place)


def _bears_fixtures(history: TrajectoryHistory, frame: int, place: str) -> bool:
    world = history.world(frame)
    fixtures = [state.position for state in world.values() if state.type in _FIXTURES]
    if world[place].type == _COUNTER:
        return bool(fixtures)
    x, _, z = world[place].position
    near = (math.hypot(other[0] - x, other[2] - z) <= _SPAN for other in fixtures)
    return world[place].type in _TOPS and any(near)
