"""Open state: "Was the fridge open when you picked up the mug?", "Is the fridge open now?", "What did you open?" """

from collections import Counter
from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import Candidate, listing, the, within
from infthor_eval.generation.questions.history import Event, History

__all__ = ["QUESTION_TYPE", "open_states", "phrase"]

QUESTION_TYPE = "open_state"
_UNASKED = frozenset({"Blinds", "Curtains", "Book", "Kettle", "ShowerCurtain", "ShowerDoor", "Window"})
_ASKED_AT = {"PickupObject", "PutObject", "SliceObject", "ToggleObjectOn"}


def open_states(history: History) -> Iterator[Candidate]:
    """Questions on what is the only one of its type and can be opened."""
    last = len(history) - 1
    singles = sorted(
        key
        for key, state in history.world(last).items()
        if state.is_open is not None and state.type not in _UNASKED and history.only_one(last, key)
    )
    phrases = Counter(phrase(history, event) for event in history.events)
    for key in singles:
        yield from _now(history, key)
        for event in history.events:
            told = phrase(history, event)
            about = key in {event.target, event.receptacle}
            if event.action in _ASKED_AT and phrases[told] == 1 and not about:
                yield from _then(history, key, event, told)
    yield from _opened(history)


def phrase(history: History, event: Event) -> str:
    """What the agent did, as the end of a "when you ..." """
    if event.action == "PutObject" and event.receptacle is not None:
        place_type = history.world(event.frame)[event.receptacle].type
        return f"put {the(event.object_type)} {within(place_type)}"
    verbs = {"PickupObject": "picked up", "SliceObject": "sliced", "ToggleObjectOn": "turned on"}
    return f"{verbs.get(event.action, event.action)} {the(event.object_type)}"


def _then(history: History, key: str, event: Event, told: str) -> Iterator[Candidate]:
    world = history.world(event.frame)
    if key in world and history.shows(event.frame, key) and _shows_event(history, event):
        answer = "yes" if world[key].is_open else "no"
        names, subjects = (the(world[key].type), told), (world[key].type, event.object_type)
        yield Candidate(QUESTION_TYPE, "Was {} open when you {}?", names, (event.frame,), (answer,), subjects)


def _shows_event(history: History, event: Event) -> bool:
    """Whether the frame after it shows what was done."""
    if event.action == "SliceObject":
        return history.shows_slices(event.frame, event.target)
    if event.receptacle is None:
        return history.shows(event.frame, event.target)
    inside = history.parent(event.frame, event.target) == event.receptacle
    return inside and history.shows(event.frame, event.target, event.receptacle)


def _now(history: History, key: str) -> Iterator[Candidate]:
    last = len(history) - 1
    state = history.world(last)[key]
    frame = next((frame for frame in range(last, -1, -1) if history.shows(frame, key)), None)
    if frame is not None and history.world(frame)[key].is_open == state.is_open:
        answer = "yes" if state.is_open else "no"
        yield Candidate(QUESTION_TYPE, "Is {} open now?", (the(state.type),), (frame,), (answer,), (state.type,))


def _opened(history: History) -> Iterator[Candidate]:
    """Everything that was opened."""
    yield from listing(
        QUESTION_TYPE,
        "What did you open?",
        (
            (event.object_type, event.frame if history.shows(event.frame, event.target) else None)
            for event in history.events
            if event.action == "OpenObject"
        ),
    )
