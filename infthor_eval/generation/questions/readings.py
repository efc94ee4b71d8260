"""Whether "the objects in or on" a receptacle are unambiguous, and which frames show them.

On a counter top, do the objects in a pan count, and does the toaster? Table 3's forms do not define
it, so they are used only where every reading gives the same answer. Our further forms define it:
objects that can be picked up and are directly there.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Set
from typing import Any

from infthor_eval.generation.questions.history import TrajectoryHistory

_TOPS = frozenset({
    "CoffeeTable", "Desk", "DiningTable", "Dresser", "Shelf", "ShelvingUnit", "SideTable",
    "TVStand",
})  # fmt: skip
_COUNTER = "CounterTop"  # so long that the distance from its middle means little
_FIXTURES = frozenset({
    "CoffeeMachine", "DeskLamp", "Desktop", "Faucet", "HousePlant", "Microwave", "RoomDecor",
    "Sink", "StoveBurner", "TableTopDecor", "Television", "Toaster",
})  # fmt: skip
_SPAN = 1.5  # maximum distance from the middle of a table to an object on it, metres


def can_be_picked_up(
    history: TrajectoryHistory, frame: int, keys: Iterable[str]
) -> frozenset[str] | None:
    """Return the objects that can be picked up, or None if the log does not report it of one."""
    states = history.states(frame)
    types = {key: states[key].type for key in keys}
    if not history.reported_types.issuperset(types.values()):
        return None
    return frozenset(
        key for key, object_type in types.items() if object_type in history.pickupable_types
    )


def is_plain(history: TrajectoryHistory, frame: int, receptacle: str) -> bool:
    """Return True if a receptacle holds only empty objects to pick up, and has no fixture on it."""
    inside = history.contents(frame, receptacle)
    loose = can_be_picked_up(history, frame, inside) == inside
    nested = any(history.contents(frame, key) for key in inside)
    return loose and not nested and not _has_fixtures(history, frame, receptacle)


def _has_fixtures(history: TrajectoryHistory, frame: int, receptacle: str) -> bool:
    states = history.states(frame)
    fixtures = [state.position for state in states.values() if state.type in _FIXTURES]
    if states[receptacle].type == _COUNTER:
        return bool(fixtures)
    x, _, z = states[receptacle].position
    near = (math.hypot(other[0] - x, other[2] - z) <= _SPAN for other in fixtures)
    return states[receptacle].type in _TOPS and any(near)


def minimal_cover(
    wanted: Set[str],
    seen_at: Mapping[int, Set[str]],
    clarity: Callable[[int, Set[str]], Any],
) -> tuple[int, ...] | None:
    """Return a small set of frames that shows all objects and from which no frame can be removed.

    Args:
        wanted: ids of the objects.
        seen_at: ids of the objects that each frame shows.
        clarity: how well a frame shows some objects, as any comparable value; among frames that
            show equally many, the clearest is chosen.

    Returns:
        The frames in order, or None if no set of frames shows all objects.
    """
    # Greedy set cover: minimum covers are NP-hard, and the checker only demands that no clue can be
    # removed.
    missing = set(wanted)
    chosen: list[int] = []
    while missing:
        most = max((len(objects & missing) for objects in seen_at.values()), default=0)
        if not most:
            return None
        candidates = [frame for frame in sorted(seen_at) if len(seen_at[frame] & missing) == most]
        best = max(candidates, key=lambda frame: clarity(frame, seen_at[frame] & missing))
        chosen.append(best)
        missing -= seen_at[best]
    for frame in list(chosen):
        rest = [other for other in chosen if other != frame]
        if wanted <= set().union(*(seen_at[other] for other in rest)):
            chosen = rest
    return tuple(sorted(chosen))
