"""Open state: "Was the fridge open?" (at any time), and further forms: open when, open now, what was opened."""

from collections import Counter
from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import Candidate, further_type, in_or_on, listing_question, with_the
from infthor_eval.generation.questions.history import Event, TrajectoryHistory

__all__ = ["FURTHER", "QUESTION_TYPE", "further_open_states", "open_states"]

QUESTION_TYPE = "open_state"
FURTHER = further_type(QUESTION_TYPE)
_CONTAINERS = frozenset({"Box", "Cabinet", "Drawer", "Fridge", "Microwave", "Safe"})
_UNASKED = frozenset({"Blinds", "Curtains", "Book", "Kettle", "ShowerCurtain", "ShowerDoor", "Window"})
_ASKED_AT = {"PickupObject", "PutObject", "SliceObject", "ToggleObjectOn"}


def open_states(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Whether a container that is the only one of its type was ever open: no where the log never has it open."""
    frames = range(len(history))
    for key in _singles(history):
        open_at = [frame for frame in frames if key in history.world(frame) and history.world(frame)[key].is_open]
        object_type = history.world(len(history) - 1)[key].type
        frame = history.clearest(open_at or frames, key)
        if object_type in _CONTAINERS and frame is not None:
            answer = "yes" if open_at else "no"
            yield Candidate(
                QUESTION_TYPE, "Was {} open?", (with_the(object_type),), (frame,), (answer,), (object_type,)
            )


def further_open_states(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Questions on when what is the only one of its type was open, and on all that was opened."""
    phrases = Counter(_phrase(history, event) for event in history.events)
    for key in _singles(history):
        yield from _now(history, key)
        for event in history.events:
            told = _phrase(history, event)
            about = key in {event.target, event.receptacle}
            if event.action in _ASKED_AT and phrases[told] == 1 and not about:
                yield from _then(history, key, event, told)
    yield from _opened(history)


def _singles(history: TrajectoryHistory) -> list[str]:
    """What can be opened and is the only one of its type."""
    last = len(history) - 1
    return sorted(
        key
        for key, state in history.world(last).items()
        if state.is_open is not None and state.type not in _UNASKED and history.only_one(last, key)
    )


def _phrase(history: TrajectoryHistory, event: Event) -> str:
    """What the agent did, as the end of a "when you ..." """
    if event.action == "PutObject" and event.receptacle is not None:
        place_type = history.world(event.frame)[event.receptacle].type
        return f"put {with_the(event.object_type)} {in_or_on(place_type)}"
    verbs = {"PickupObject": "picked up", "SliceObject": "sliced", "ToggleObjectOn": "turned on"}
    return f"{verbs.get(event.action, event.action)} {with_the(event.object_type)}"


def _then(history: TrajectoryHistory, key: str, event: Event, told: str) -> Iterator[Candidate]:
    world = history.world(event.frame)
    if key in world and history.shows(event.frame, key) and _shows_event(history, event):
        answer = "yes" if world[key].is_open else "no"
        names, subjects = (with_the(world[key].type), told), (world[key].type, event.object_type)
        yield Candidate(FURTHER, "Was {} open when you {}?", names, (event.frame,), (answer,), subjects)


def _shows_event(history: TrajectoryHistory, event: Event) -> bool:
    """Whether the frame after it shows what was done."""
    if event.action == "SliceObject":
        return history.shows_slices(event.frame, event.target)
    if event.receptacle is None:
        return history.shows(event.frame, event.target)
    inside = history.parent(event.frame, event.target) == event.receptacle
    return inside and history.shows(event.frame, event.target, event.receptacle)


def _now(history: TrajectoryHistory, key: str) -> Iterator[Candidate]:
    last = len(history) - 1
    state = history.world(last)[key]
    changed = next((frame for frame in range(last, -1, -1) if _is_open(history, frame, key) != state.is_open), -1)
    frame = history.clearest(range(changed + 1, last + 1), key)
    if frame is not None:
        answer = "yes" if state.is_open else "no"
        yield Candidate(FURTHER, "Is {} open now?", (with_the(state.type),), (frame,), (answer,), (state.type,))


def _is_open(history: TrajectoryHistory, frame: int, key: str) -> bool | None:
    state = history.world(frame).get(key)
    return None if state is None else state.is_open


def _opened(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Everything that was opened."""
    yield from listing_question(
        FURTHER,
        "What did you open?",
        (
            (event.object_type, event.frame if history.shows(event.frame, event.target) else None)
            for event in history.events
            if event.action == "OpenObject"
        ),
    )
