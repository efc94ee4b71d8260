"""Open state: "Was the fridge open?" (ever); further forms: open when, now, and what was opened."""

from collections import Counter
from collections.abc import Iterable, Iterator

from infthor_eval.generation.questions.candidates import Candidate, further_type, listing_question
from infthor_eval.generation.questions.history import Event, TrajectoryHistory
from infthor_eval.household.wording import in_or_on, with_the

QUESTION_TYPE = "open_state"
FURTHER = further_type(QUESTION_TYPE)
CONTAINERS = frozenset({"Box", "Cabinet", "Drawer", "Fridge", "Microwave", "Safe"})
_UNASKED = frozenset(
    {"Blinds", "Curtains", "Book", "Kettle", "ShowerCurtain", "ShowerDoor", "Window"}
)
_ASKED_AT = {"PickupObject", "PutObject", "SliceObject", "ToggleObjectOn"}


def open_states(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield questions on whether a container that is the only one of its type was ever open."""
    frames = range(len(history))
    for key in _singles(history):
        open_at = [
            frame
            for frame in frames
            if key in history.states(frame) and history.states(frame)[key].is_open
        ]
        object_type = history.states(len(history) - 1)[key].type
        frame = _clearest(history, open_at or frames, key)
        if object_type in CONTAINERS and frame is not None:
            names = (with_the(object_type),)
            answer = "yes" if open_at else "no"
            yield Candidate(
                QUESTION_TYPE, "Was {} open?", names, (frame,), (answer,), (object_type,)
            )


def further_open_states(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield questions on when the only object of its type was open, and on all that was opened."""
    phrases = Counter(_phrase(history, event) for event in history.events)
    for key in _singles(history):
        yield from _now(history, key)
        for event in history.events:
            phrase = _phrase(history, event)
            # Then the action itself tells whether it was open.
            involved = key in {event.target, event.receptacle}
            if event.action in _ASKED_AT and phrases[phrase] == 1 and not involved:
                yield from _then(history, key, event, phrase)
    opened = (event for event in history.events if event.action == "OpenObject")
    shown = ((event.object_type, history.opening_clues(event)) for event in opened)
    yield from listing_question(FURTHER, "What did you open?", shown)


def _singles(history: TrajectoryHistory) -> list[str]:
    """Return the ids of the objects that can be opened and are the only ones of their types."""
    last = len(history) - 1
    return sorted(
        key
        for key, state in history.states(last).items()
        if state.is_open is not None
        and state.type not in _UNASKED
        and history.is_only_one(last, key)
    )


def _phrase(history: TrajectoryHistory, event: Event) -> str:
    """Return an action as the end of a clause "when you ..."."""
    if event.action == "PutObject" and event.receptacle is not None:
        receptacle_type = history.states(event.frame)[event.receptacle].type
        return f"put {with_the(event.object_type)} {in_or_on(receptacle_type)}"
    verbs = {"PickupObject": "picked up", "SliceObject": "sliced", "ToggleObjectOn": "turned on"}
    return f"{verbs.get(event.action, event.action)} {with_the(event.object_type)}"


def _then(history: TrajectoryHistory, key: str, event: Event, phrase: str) -> Iterator[Candidate]:
    states = history.states(event.frame)
    clues = _event_clues(history, event)
    if key in states and history.shows_whether_open(event.frame, key) and clues is not None:
        answer = "yes" if states[key].is_open else "no"
        names = (with_the(states[key].type), phrase)
        subjects = (states[key].type, event.object_type)
        yield Candidate(FURTHER, "Was {} open when you {}?", names, clues, (answer,), subjects)


def _event_clues(history: TrajectoryHistory, event: Event) -> tuple[int, ...] | None:
    """Return the frames that show an event, or None if they do not."""
    if event.action == "PutObject":
        return history.put_clues(next(m for m in history.moves if m.after == event.frame))
    if event.action == "SliceObject":
        is_shown = history.shows_slices(event.frame, event.target)
    else:
        is_shown = history.shows(event.frame, event.target)
        is_shown = is_shown and history.is_alone_in_frame(event.frame, event.target)
    return (event.frame,) if is_shown else None


def _now(history: TrajectoryHistory, key: str) -> Iterator[Candidate]:
    last = len(history) - 1
    state = history.states(last)[key]
    changed = next(
        (frame for frame in range(last, -1, -1) if _is_open(history, frame, key) != state.is_open),
        -1,
    )
    frame = _clearest(history, range(changed + 1, last + 1), key)
    if frame is not None:
        answer = "yes" if state.is_open else "no"
        yield Candidate(
            FURTHER, "Is {} open now?", (with_the(state.type),), (frame,), (answer,), (state.type,)
        )


def _clearest(history: TrajectoryHistory, frames: Iterable[int], key: str) -> int | None:
    """Return the frame that shows best whether an object is open, or None."""
    return history.clearest((f for f in frames if history.shows_whether_open(f, key)), key)


def _is_open(history: TrajectoryHistory, frame: int, key: str) -> bool | None:
    state = history.states(frame).get(key)
    return None if state is None else state.is_open
