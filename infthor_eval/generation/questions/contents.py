"""Slicing and container content: what was sliced, and what a receptacle held at a told moment."""

from collections import Counter
from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import MANY, Candidate, answer_of, distinct, the, within
from infthor_eval.generation.questions.evidence import cover
from infthor_eval.generation.questions.history import Event, History, is_same
from infthor_eval.household.wording import canonical

__all__ = ["CONTENT", "SLICING", "at_opening", "at_pickup", "at_slicing", "slicings"]

CONTENT = "container_content"
SLICING = "slicing"
Asked = tuple[str, tuple[str, ...]]  # a form and its names


def slicings(history: History) -> Iterator[Candidate]:
    """What the agent sliced."""
    events = [event for event in history.events if event.action == "SliceObject"]
    types = [event.object_type for event in events]
    shown = all(history.shows_slices(event.frame, event.target) for event in events)
    if events and shown and len(set(types)) == len(types) and distinct(types):
        answers = tuple(answer_of(item) for item in types)
        clues = tuple(event.frame for event in events)
        yield Candidate(SLICING, "What did you slice?", (), clues, answers, tuple(types))


def at_slicing(history: History) -> Iterator[Candidate]:
    """What else lay where something was sliced."""
    events = [event for event in history.events if event.action == "SliceObject"]
    count = Counter(event.object_type for event in events)
    for event in events:
        place = history.parent(event.frame - 1, event.target)
        if count[event.object_type] == 1 and place is not None and history.shows_slices(event.frame, event.target):
            place_type = history.world(event.frame)[place].type
            asked = "What else was {} when you sliced {}?", (within(place_type), the(event.object_type))
            skipped = frozenset({event.object_type, f"{event.object_type}Sliced"})
            yield from _contents(history, SLICING, asked, event, place, skipped)


def at_opening(history: History) -> Iterator[Candidate]:
    """What was in the only receptacle of its type when it was first opened."""
    opened: set[str] = set()
    for event in history.events:
        first = event.action == "OpenObject" and event.target not in opened
        opened |= {event.target} if event.action == "OpenObject" else set()
        if first and history.only_one(event.frame, event.target):
            asked = "What was {} when you first opened it?", (within(event.object_type),)
            yield from _contents(history, CONTENT, asked, event, event.target, frozenset())


def at_pickup(history: History) -> Iterator[Candidate]:
    """What was left where something was picked up."""
    events = [event for event in history.events if event.action == "PickupObject"]
    count = Counter(event.object_type for event in events)
    for event in events:
        place = history.parent(event.frame - 1, event.target)
        if count[event.object_type] == 1 and place is not None and place in history.world(event.frame):
            place_type = history.world(event.frame)[place].type
            asked = "What else was {} when you picked up {} from it?", (within(place_type), the(event.object_type))
            yield from _contents(history, CONTENT, asked, event, place, frozenset())


def _contents(
    history: History, question_type: str, asked: Asked, event: Event, place: str, skipped: frozenset[str]
) -> Iterator[Candidate]:
    """A question on what a receptacle holds right after an event, shown while that does not change."""
    inside = history.contents(event.frame, place)
    wanted = {key for key in inside if history.world(event.frame)[key].type not in skipped}
    shown = {}
    for frame in range(event.frame, len(history)):
        if history.contents(frame, place) != inside:
            break
        if history.shows(frame, place) and not _others(history, frame, place):
            shown[frame] = frozenset(key for key in wanted if history.shows_inside(frame, key))
    clues = cover(wanted, shown) if wanted else None
    types = sorted(history.world(event.frame)[key].type for key in wanted)
    if clues is not None and len(set(types)) == len(types) <= MANY and distinct(types):
        place_type = history.world(event.frame)[place].type
        answers = tuple(answer_of(item) for item in types)
        yield Candidate(question_type, *asked, clues, answers, (place_type, *types))


def _others(history: History, frame: int, place: str) -> bool:
    """Whether a frame shows contents of another receptacle that people would call the same."""
    world = history.world(frame)
    object_type = canonical(world[place].type)
    parents = {history.parent(frame, key) for key in history.seen(frame) if key in world} - {None}
    others = (parent for parent in parents if parent is not None and not is_same(parent, place))
    return any(canonical(world[parent].type) == object_type for parent in others)
