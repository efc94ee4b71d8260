"""Slicing and container content: what was sliced, and what a receptacle held, at a told moment or all along.

Table 3's forms do not say what counts as an object in or on something, so they are asked only where every reading gives
the same answer (`readings`). Ours do say: what can be picked up, and is directly there.
"""

from collections import Counter
from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import (
    MANY,
    Candidate,
    answer_of,
    are_distinguishable,
    further_type,
    in_or_on,
    with_the,
)
from infthor_eval.generation.questions.evidence import minimal_cover
from infthor_eval.generation.questions.history import Event, TrajectoryHistory, is_same_object
from infthor_eval.generation.questions.readings import can_be_picked_up, is_plain
from infthor_eval.household.wording import canonical_type

__all__ = ["CONTENT", "FURTHER", "SLICING", "at_opening", "at_pickup", "at_slicing", "contents", "slicings"]

CONTENT = "container_content"
FURTHER = further_type(CONTENT)
SLICING = "slicing"
Asked = tuple[str, tuple[str, ...]]  # a form and its names


def slicings(history: TrajectoryHistory) -> Iterator[Candidate]:
    """What the agent sliced."""
    events = [event for event in history.events if event.action == "SliceObject"]
    types = [event.object_type for event in events]
    shown = all(history.shows_slices(event.frame, event.target) for event in events)
    if events and shown and len(set(types)) == len(types) and are_distinguishable(types):
        answers = tuple(answer_of(item) for item in types)
        clues = tuple(event.frame for event in events)
        yield Candidate(SLICING, "What did you slice?", (), clues, answers, tuple(types))


def at_slicing(history: TrajectoryHistory) -> Iterator[Candidate]:
    """What lay where something was sliced, that itself among it."""
    events = [event for event in history.events if event.action == "SliceObject"]
    count = Counter(event.object_type for event in events)
    for event in events:
        place = history.parent(event.frame - 1, event.target)
        if count[event.object_type] > 1 or place is None or not is_plain(history, event.frame, place):
            continue
        inside = history.contents(event.frame, place)
        slices = sorted(key for key in inside if key.startswith(f"{event.target}|") and history.shows(event.frame, key))
        others = frozenset(key for key in inside if not key.startswith(f"{event.target}|"))
        if slices and others:
            place_type = history.world(event.frame)[place].type
            asked = "What objects were {} when you slice {}?", (in_or_on(place_type), with_the(event.object_type))
            frames = _unchanged(history, event.frame, place)
            yield from _contents(history, SLICING, asked, frames, place, others | {slices[0]})


def contents(history: TrajectoryHistory) -> Iterator[Candidate]:
    """What is in or on the only receptacle of its type all along."""
    last = len(history) - 1
    places = {parent for key in history.world(last) if (parent := history.parent(last, key)) is not None}
    for place in sorted(places):
        frames = _unchanged(history, 0, place)
        if len(frames) == len(history) and history.only_one(last, place) and is_plain(history, last, place):
            asked = "What objects were {}?", (in_or_on(history.world(last)[place].type),)
            yield from _contents(history, CONTENT, asked, frames, place, history.contents(last, place))


def at_opening(history: TrajectoryHistory) -> Iterator[Candidate]:
    """What was in the only receptacle of its type when it was first opened."""
    opened: set[str] = set()
    for event in history.events:
        first = event.action == "OpenObject" and event.target not in opened
        opened |= {event.target} if event.action == "OpenObject" else set()
        if first and history.only_one(event.frame, event.target):
            form = "Which things that can be picked up were directly {} when you first opened it?"
            asked = form, (in_or_on(event.object_type),)
            yield from _loose_contents(history, asked, event, event.target)


def at_pickup(history: TrajectoryHistory) -> Iterator[Candidate]:
    """What was left where something was picked up."""
    events = [event for event in history.events if event.action == "PickupObject"]
    count = Counter(event.object_type for event in events)
    for event in events:
        place = history.parent(event.frame - 1, event.target)
        if count[event.object_type] == 1 and place is not None and place in history.world(event.frame):
            place_type = history.world(event.frame)[place].type
            form = "Which other things that can be picked up were directly {} when you picked up {} from it?"
            yield from _loose_contents(
                history, (form, (in_or_on(place_type), with_the(event.object_type))), event, place
            )


def _loose_contents(history: TrajectoryHistory, asked: Asked, event: Event, place: str) -> Iterator[Candidate]:
    """A question on what can be picked up of what a receptacle holds right after an event."""
    wanted = can_be_picked_up(history, event.frame, history.contents(event.frame, place))
    if wanted is not None:
        yield from _contents(history, FURTHER, asked, _unchanged(history, event.frame, place), place, wanted)


def _unchanged(history: TrajectoryHistory, first: int, place: str) -> range:
    """The frames from one on during which a receptacle holds the same."""
    inside = history.contents(first, place)
    changed = (frame for frame in range(first, len(history)) if history.contents(frame, place) != inside)
    return range(first, next(changed, len(history)))


def _contents(
    history: TrajectoryHistory, question_type: str, asked: Asked, frames: range, place: str, wanted: frozenset[str]
) -> Iterator[Candidate]:
    """A question on objects in a receptacle, with the frames that show them there."""
    shown = {
        frame: frozenset(key for key in wanted if history.shows_inside(frame, key))
        for frame in frames
        if history.shows(frame, place) and not _others(history, frame, place)
    }
    clues = minimal_cover(wanted, shown, lambda frame, keys: history.clearness(frame, *keys)) if wanted else None
    types = sorted(_whole_types(history, frames[0], wanted))
    if clues is not None and len(set(types)) == len(types) <= MANY and are_distinguishable(types):
        place_type = history.world(frames[0])[place].type
        answers = tuple(answer_of(item) for item in types)
        yield Candidate(question_type, *asked, clues, answers, (place_type, *types))


def _whole_types(history: TrajectoryHistory, frame: int, keys: frozenset[str]) -> list[str]:
    """The types of objects; of a fresh slice that of what was cut."""
    world = history.world(frame)
    cut = {event.target for event in history.events if event.action == "SliceObject" and event.frame == frame}
    fresh = {key for key in keys for whole in cut if key.startswith(f"{whole}|")}
    return [world[key].type.removesuffix("Sliced") if key in fresh else world[key].type for key in keys]


def _others(history: TrajectoryHistory, frame: int, place: str) -> bool:
    """Whether a frame shows contents of another receptacle that people would call the same."""
    world = history.world(frame)
    object_type = canonical_type(world[place].type)
    parents = {history.parent(frame, key) for key in history.seen(frame) if key in world} - {None}
    others = (parent for parent in parents if parent is not None and not is_same_object(parent, place))
    return any(canonical_type(world[parent].type) == object_type for parent in others)
