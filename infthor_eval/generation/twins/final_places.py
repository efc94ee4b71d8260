"""Which object of a pair of worlds a final task can be about: one whose place only memory tells.

Its receptacle at the end of the history differs between the worlds and is of another type, and both
worlds have shown it there some time ago.
"""

import random
from collections.abc import Iterator
from dataclasses import dataclass

from infthor_eval.formats.twins import TwinPlace
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.twins.comparison import Difference
from infthor_eval.generation.twins.kinds import Worlds
from infthor_eval.generation.twins.rewriting import whole_of
from infthor_eval.household.affordances import goes_into
from infthor_eval.household.containment import logged_parent
from infthor_eval.household.first_place import apart
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.view import ThorObject

_AGO = 10  # frames at least since the object was last shown where it is
_APART = 1.5  # metres at least between its two places: nobody reaches both from one pose
_GOALS = 2  # receptacles at most that are tried for one object


@dataclass(frozen=True)
class Errand:
    """An object to find, and where to put it.

    Attributes:
        items: id of the object in either world.
        places: where it is at the end of the history in either world.
        receptacle: id of what it is put into or onto.
    """

    items: tuple[str, str]
    places: tuple[TwinPlace, TwinPlace]
    receptacle: str


def errands(
    worlds: Worlds,
    histories: tuple[TrajectoryHistory, TrajectoryHistory],
    last: int,
    fixtures: dict[str, ThorObject],
    rng: random.Random,
) -> Iterator[Errand]:
    """Yield what final tasks of a pair can be about, in random order.

    Args:
        worlds: the pair.
        histories: what happened in either world.
        last: frame with which the history ends and the final task begins.
        fixtures: the objects at the start, by id.
        rng: draws the order.

    Raises:
        Difference: there is none; the message is the reason that comes nearest.
    """
    if any(state.held for history in histories for state in history.states(last).values()):
        raise Difference("the agent has something in its hand")
    found = False
    reasons = ["no object has another place in the end"]
    keys = sorted(key for key in worlds.changed if whole_of(key) == key)
    rng.shuffle(keys)
    for key in keys:
        items = key, worlds.ids.get(key, key)
        try:
            places = _places(items, histories, last, fixtures)
        except Difference as reason:
            reasons.append(str(reason))
            continue
        for receptacle in _goals(key, places, histories, fixtures, rng):
            found = True
            yield Errand(items, places, receptacle)
    if not found:
        raise Difference(reasons[-1])


def _places(
    items: tuple[str, str],
    histories: tuple[TrajectoryHistory, TrajectoryHistory],
    last: int,
    fixtures: dict[str, ThorObject],
) -> tuple[TwinPlace, TwinPlace]:
    one, other = (
        _place(item, history, last, fixtures)
        for item, history in zip(items, histories, strict=True)
    )
    if not are_apart((one, other), fixtures):
        raise Difference("the object's places are of one type, or near each other")
    return one, other


def are_apart(places: tuple[TwinPlace, TwinPlace], fixtures: dict[str, ThorObject]) -> bool:
    """Return True if two places are on furniture of different types, and not near each other."""
    types = {canonical_type(fixtures[place.receptacle].object_type) for place in places}
    return len(types) == len(places) and apart(places) >= _APART


def _place(
    item: str, history: TrajectoryHistory, last: int, fixtures: dict[str, ThorObject]
) -> TwinPlace:
    """Return where the only object of its type is in the end; see `place_in`."""
    if not history.is_only_one(last, item):
        raise Difference("there are more of the object's type")
    return place_in(history, last, item, fixtures)


def place_in(
    history: TrajectoryHistory, last: int, item: str, fixtures: dict[str, ThorObject]
) -> TwinPlace:
    """Return where an object is in the end, if it was shown there, and not of late.

    Args:
        history: what happened.
        last: frame with which the history ends.
        item: id of the object.
        fixtures: the objects at the start, by id.

    Raises:
        Difference: it is on nothing that stays, was never shown there, or a moment ago.
    """
    states = history.states(last)
    state = states.get(item)
    holder = None if state is None else logged_parent(state, states)
    if state is None or holder is None or holder not in fixtures or fixtures[holder].pickupable:
        raise Difference("the object is in or on nothing that stays")
    shown = [frame for frame in range(last + 1) if _shows_there(history, frame, item, holder)]
    if not shown:
        raise Difference("the object is not shown at its place")
    if last - shown[-1] < _AGO:
        raise Difference("the object was in view a moment ago")
    x, _, z = state.position
    return TwinPlace(holder, x, z)


def _shows_there(history: TrajectoryHistory, frame: int, item: str, holder: str) -> bool:
    states = history.states(frame)
    return history.shows(frame, item) and logged_parent(states[item], states) == holder


def _goals(
    item: str,
    places: tuple[TwinPlace, TwinPlace],
    histories: tuple[TrajectoryHistory, TrajectoryHistory],
    fixtures: dict[str, ThorObject],
    rng: random.Random,
) -> list[str]:
    """Return what the object can be put onto: open furniture that is the only one of its type."""
    taken = {canonical_type(fixtures[place.receptacle].object_type) for place in places}
    goals = [
        key
        for key, obj in sorted(fixtures.items())
        if obj.receptacle
        and not obj.pickupable
        and not obj.openable
        and canonical_type(obj.object_type) not in taken
        and goes_into(item.partition("|")[0], obj.object_type)
        and all(history.is_only_one(0, key) for history in histories)
        and any(histories[0].shows(frame, key) for frame in range(len(histories[0])))
    ]
    rng.shuffle(goals)
    return goals[:_GOALS]
