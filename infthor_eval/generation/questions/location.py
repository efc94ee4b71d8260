"""Object location tracing: where something was, where it was moved, where it is now."""

from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import Candidate, answer_of, distinct, the
from infthor_eval.generation.questions.history import History, Move

__all__ = ["QUESTION_TYPE", "locations"]

QUESTION_TYPE = "location_tracing"


def locations(history: History) -> Iterator[Candidate]:
    """Questions on every object that alone of its type was handled."""
    for object_type, items in sorted(history.handled.items()):
        moves = history.moves_of(next(iter(items))) if len(items) == 1 else ()
        if moves:
            yield from _origin(history, object_type, moves)
            yield from _destination(history, object_type, moves)
            yield from _now(history, object_type, moves)
            yield from _journey(history, object_type, moves)


def _origin(history: History, object_type: str, moves: tuple[Move, ...]) -> Iterator[Candidate]:
    move = moves[0]
    if not _left(history, move):
        return
    when = "first picked it up" if len(moves) > 1 else "picked it up"
    place = history.world(move.before)[move.origin or ""].type
    yield _candidate(f"Where was {{}} before you {when}?", (move.before,), [place], object_type)


def _destination(history: History, object_type: str, moves: tuple[Move, ...]) -> Iterator[Candidate]:
    move = moves[0]
    if len(moves) == 1 and history.shows_put(move):
        place = history.world(move.after)[move.target].type
        yield _candidate("Where did you move {} to?", (move.after,), [place], object_type)


def _now(history: History, object_type: str, moves: tuple[Move, ...]) -> Iterator[Candidate]:
    move, last = moves[-1], len(history) - 1
    alone = move.item in history.world(last) and history.only_one(last, move.item)
    if alone and history.shows_put(move) and history.parent(last, move.item) == move.target:
        place = history.world(last)[move.target].type
        yield _candidate("Where is {} now?", (move.after,), [place], object_type)


def _journey(history: History, object_type: str, moves: tuple[Move, ...]) -> Iterator[Candidate]:
    first = moves[0]
    if not _left(history, first):
        return
    if not all(history.shows_put(move) for move in moves):
        return
    places = [history.world(first.before)[first.origin or ""].type]
    places += [history.world(move.after)[move.target].type for move in moves]
    if distinct(places):
        clues = (first.before, *(move.after for move in moves))
        yield _candidate("In which places was {}, from first to last?", clues, places, object_type)


def _left(history: History, move: Move) -> bool:
    """Whether the frame before the pick-up shows the object, and no other of its type, where it was."""
    shown = move.origin is not None and history.shows(move.before, move.item, move.origin)
    return shown and history.alone(move.before, move.item)


def _candidate(form: str, clues: tuple[int, ...], places: list[str], object_type: str) -> Candidate:
    answers = tuple(answer_of(place) for place in places)
    return Candidate(QUESTION_TYPE, form, (the(object_type),), clues, answers, (object_type, *places))
