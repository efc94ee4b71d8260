"""Movement counting: how often something was moved, opened or put somewhere, and how many things were moved."""

from collections import defaultdict
from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import Candidate, the, within
from infthor_eval.generation.questions.history import Event, History, Move
from infthor_eval.household.wording import an, noun

__all__ = ["QUESTION_TYPE", "counts"]

QUESTION_TYPE = "movement_counting"


def counts(history: History) -> Iterator[Candidate]:
    """Every count whose occasions are all shown, a frame each."""
    yield from _moves(history)
    yield from _openings(history)
    yield from _puts(history)
    yield from _items(history)


def _moves(history: History) -> Iterator[Candidate]:
    """Of every object that alone of its type was handled. A move ends when the object is put down."""
    for object_type, items in sorted(history.handled.items()):
        moves = history.moves_of(next(iter(items))) if len(items) == 1 else ()
        if moves and all(history.shows(move.after, move.item, move.target) for move in moves):
            frames = [move.after for move in moves]
            form = "How many times did you pick up {} and put it down again?"
            yield _count(form, (the(object_type),), frames, object_type)


def _openings(history: History) -> Iterator[Candidate]:
    """Of every type: "the fridge" where there is one, "a drawer" where there are several."""
    by_type: dict[str, list[Event]] = defaultdict(list)
    for event in history.events:
        if event.action == "OpenObject":
            by_type[event.object_type].append(event)
    for object_type, events in sorted(by_type.items()):
        if all(history.shows(event.frame, event.target) for event in events):
            single = all(history.only_one(event.frame, event.target) for event in events)
            name = the(object_type) if single else an(noun(object_type))
            yield _count("How many times did you open {}?", (name,), [event.frame for event in events], object_type)


def _puts(history: History) -> Iterator[Candidate]:
    """Of every receptacle that alone is of its type."""
    by_target: dict[str, list[Move]] = defaultdict(list)
    for move in history.moves:
        by_target[move.target].append(move)
    for target, moves in sorted(by_target.items()):
        shown = all(history.shows_put(move) for move in moves)
        if shown and all(history.only_one(move.after, target) for move in moves):
            place_type = history.world(moves[0].after)[target].type
            frames = [move.after for move in moves]
            yield _count("How many times did you put something {}?", (within(place_type),), frames, place_type)


def _items(history: History) -> Iterator[Candidate]:
    """Of the different objects, each with the frame in which it is first held."""
    first: dict[str, int] = {}
    for event in history.events:
        if event.action == "PickupObject":
            first.setdefault(event.target, event.frame)
    if first and all(history.shows(frame, item) for item, frame in first.items()):
        yield _count("How many different objects did you pick up?", (), sorted(first.values()), "#")


def _count(form: str, names: tuple[str, ...], frames: list[int], subject: str) -> Candidate:
    return Candidate(QUESTION_TYPE, form, names, tuple(frames), (str(len(frames)),), (subject,))
