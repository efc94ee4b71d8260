"""Slicing and container content: what was sliced, and what a receptacle held at a told moment."""

from collections import Counter
from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import MANY, Candidate, answer_of, distinct, the, within
from infthor_eval.generation.questions.evidence import cover
from infthor_eval.generation.questions.history import Event, History, canonical, is_same

__all__ = ["CONTENT", "SLICING", "at_opening", "at_pickup", "at_slicing", "slicings"]

CONTENT = "container_content"
SLICING = "slicing"
Asked = tuple[str, tuple[str, ...]]  # a form and its names


def slicings(history: History) -> Iterator[Candidate]:
    """What the agent sliced."""
    events = [event for event in history.events if event.action == "SliceObject"]
    kinds = [event.kind for event in events]
    shown = all(history.shows_slices(event.frame, event.target) for event in events)
    if events and shown and len(set(kinds)) == len(kinds) and distinct(kinds):
        answers = tuple(answer_of(kind) for kind in kinds)
        clues = tuple(event.frame for event in events)
        yield Candidate(SLICING, "What did you slice?", (), clues, answers, tuple(kinds))


def at_slicing(history: History) -> Iterator[Candidate]:
    """What else lay where something was sliced."""
    events = [event for event in history.events if event.action == "SliceObject"]
    count = Counter(event.kind for event in events)
    for event in events:
        place = history.parent(event.frame - 1, event.target)
        if count[event.kind] == 1 and place is not None and history.shows_slices(event.frame, event.target):
            kind = history.world(event.frame)[place].type
            asked = "What else was {} when you sliced {}?", (within(kind), the(event.kind))
            leave_out = frozenset({event.kind, f"{event.kind}Sliced"})
            yield from _contents(history, SLICING, asked, event, place, leave_out)


def at_opening(history: History) -> Iterator[Candidate]:
    """What was in the only receptacle of its type when it was first opened."""
    opened: set[str] = set()
    for event in history.events:
        first = event.action == "OpenObject" and event.target not in opened
        opened |= {event.target} if event.action == "OpenObject" else set()
        if first and history.only_one(event.frame, event.target):
            asked = "What was {} when you first opened it?", (within(event.kind),)
            yield from _contents(history, CONTENT, asked, event, event.target, frozenset())


def at_pickup(history: History) -> Iterator[Candidate]:
    """What was left where something was picked up."""
    events = [event for event in history.events if event.action == "PickupObject"]
    count = Counter(event.kind for event in events)
    for event in events:
        place = history.parent(event.frame - 1, event.target)
        if count[event.kind] == 1 and place is not None and place in history.world(event.frame):
            kind = history.world(event.frame)[place].type
            asked = "What else was {} when you picked up {} from it?", (within(kind), the(event.kind))
            yield from _contents(history, CONTENT, asked, event, place, frozenset())


def _contents(
    history: History, kind: str, asked: Asked, event: Event, place: str, leave_out: frozenset[str]
) -> Iterator[Candidate]:
    """A question on what a receptacle holds right after an event, shown while that does not change."""
    inside = history.contents(event.frame, place)
    wanted = {key for key in inside if history.world(event.frame)[key].type not in leave_out}
    shown = {}
    for frame in range(event.frame, len(history)):
        if history.contents(frame, place) != inside:
            break
        if history.shows(frame, place) and not _others(history, frame, place):
            shown[frame] = frozenset(key for key in wanted if history.shows_inside(frame, key))
    clues = cover(wanted, shown) if wanted else None
    kinds = sorted(history.world(event.frame)[key].type for key in wanted)
    if clues is not None and len(set(kinds)) == len(kinds) <= MANY and distinct(kinds):
        place_kind = history.world(event.frame)[place].type
        yield Candidate(kind, *asked, clues, tuple(answer_of(item) for item in kinds), (place_kind, *kinds))


def _others(history: History, frame: int, place: str) -> bool:
    """Whether a frame shows contents of another receptacle that people would call the same."""
    world = history.world(frame)
    kind = canonical(world[place].type)
    parents = {history.parent(frame, key) for key in history.seen(frame) if key in world} - {None}
    others = (parent for parent in parents if parent is not None and not is_same(parent, place))
    return any(canonical(world[parent].type) == kind for parent in others)
