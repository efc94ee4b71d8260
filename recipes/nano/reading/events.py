"""What happened between the frames of a trajectory, for a loss at each frame's end.

To say what changed since the frame before is a step on the way to most answers, and is known for
every frame, not only for those that a question is about.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise

from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.formats.packed.paths import SetPath
from infthor_eval.formats.step_log import iter_object_states, read_steps
from infthor_eval.household.wording import canonical_type

_FAR = 2  # frames with more steps between them are not compared


class Event(IntEnum):
    """A kind of event; PUT and PICKED_UP are about a thing, those after them about its place."""

    PUT = 0
    PUT_INTO = 1
    PICKED_UP = 2
    PICKED_UP_FROM = 3
    OPENED = 4
    CLOSED = 5


@dataclass(frozen=True)
class Happening:
    """An event and its type of thing.

    Attributes:
        place: place of the first frame after it, from 0.
        event: what happened.
        type: the type of thing it happened to, or that it happened in, as people name it.
    """

    place: int
    event: Event
    type: str


def read_events(folder: SetPath) -> list[Happening]:
    """Read the events of a replayed trajectory, in order.

    Args:
        folder: folder of the trajectory, with its step log.
    """
    steps = sorted(read_steps(folder), key=lambda step: step.img_idx)
    happenings: list[Happening] = []
    parents: dict[str, str] = {}
    for place, (step, states) in enumerate(zip(steps, iter_object_states(steps), strict=True)):
        action = (step.action or "").partition(" ")[0]
        if step.success and step.target:
            happenings += [
                Happening(place, event, canonical_type(object_type_of(key)))
                for event, key in _changes(action, step.target, step.receptacle, parents)
                if key
            ]
        # The states are one mapping that is brought up to date for each step.
        parents = {key: state.parents[0] for key, state in states.items() if state.parents}
    return happenings


def _changes(
    action: str, target: str, receptacle: str | None, parents: dict[str, str]
) -> list[tuple[Event, str | None]]:
    """Return what an action did to which object; `parents` are those before it."""
    if action == "PutObject":
        return [(Event.PUT, target), (Event.PUT_INTO, receptacle)]
    if action == "PickupObject":
        return [(Event.PICKED_UP, target), (Event.PICKED_UP_FROM, parents.get(target))]
    kinds = {"OpenObject": Event.OPENED, "CloseObject": Event.CLOSED}
    return [(kinds[action], target)] if action in kinds else []


def events_in(
    happenings: Sequence[Happening], places: Sequence[int]
) -> list[list[tuple[Event, str]] | None]:
    """Return for each of some frames what happened since the one before, None if that is far.

    Args:
        happenings: all events of the trajectory.
        places: places of the frames, ascending.
    """
    events: list[list[tuple[Event, str]] | None] = [None] if places else []
    for before, place in pairwise(places):
        since = [one for one in happenings if before < one.place <= place]
        is_near = place - before <= _FAR
        events.append([(one.event, one.type) for one in since] if is_near else None)
    return events
