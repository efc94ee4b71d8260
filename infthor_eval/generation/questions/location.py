"""Object location tracing: where an object was, where it was moved, and where it is now.

It must be clear which pick-up or put is meant: "before you picked it up" is ambiguous for an object
picked up twice.
"""

from collections.abc import Iterator, Sequence

from infthor_eval.generation.questions import candidates
from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.history import ObjectMove, TrajectoryHistory
from infthor_eval.household.wording import answer_of, canonical_type, in_or_on, with_the

QUESTION_TYPE = "location_tracing"
FURTHER = candidates.further_type(QUESTION_TYPE)


def locations(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield questions on every object that is the only one of its type that was picked up."""
    for object_type, moves in _moves_by_type(history):
        yield from _before_put(history, object_type, moves)
        yield from _moved_from(history, object_type, moves)
        yield from _now(history, object_type, moves)


def further_locations(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield further questions on the same objects."""
    for object_type, moves in _moves_by_type(history):
        yield from _origin(history, object_type, moves)
        yield from _destination(history, object_type, moves)
        yield from _journey(history, object_type, moves)


def _moves_by_type(history: TrajectoryHistory) -> Iterator[tuple[str, tuple[ObjectMove, ...]]]:
    for object_type, items in sorted(history.picked_up_by_type.items()):
        moves = history.moves_of(next(iter(items))) if len(items) == 1 else ()
        if moves:
            yield object_type, moves


def _before_put(
    history: TrajectoryHistory, object_type: str, moves: tuple[ObjectMove, ...]
) -> Iterator[Candidate]:
    # Only for the first move, and only if no other leads to such a container: then there is one
    # place before it.
    move = moves[0]
    to = history.target_type(move)
    once = [history.target_type(other) for other in moves].count(to) == 1
    is_shown = _shows_origin(history, move) and history.shows_put(move)
    if once and is_shown and _changes(history, move):
        form = "Where was {} before you put it {}?"
        clues = (move.before, move.after)
        places = [_start(history, move)]
        yield _candidate(QUESTION_TYPE, form, clues, places, object_type, in_or_on(to))


def _moved_from(
    history: TrajectoryHistory, object_type: str, moves: tuple[ObjectMove, ...]
) -> Iterator[Candidate]:
    # Only for the last move, and only if no other starts at such a container: then there is one
    # place after it.
    move = moves[-1]
    if (
        not _shows_origin(history, move)
        or not history.shows_put(move)
        or not _is_down(history, move)
    ):
        return
    origin = _start(history, move)
    others = [_start(history, other) for other in moves[:-1]]
    if origin is None or None in others:
        return
    if _changes(history, move) and origin not in others:
        form = "Where did you move {} from {}?"
        clues = (move.before, move.after)
        places = [history.target_type(move)]
        yield _candidate(QUESTION_TYPE, form, clues, places, object_type, with_the(origin))


def _now(
    history: TrajectoryHistory, object_type: str, moves: tuple[ObjectMove, ...]
) -> Iterator[Candidate]:
    move = moves[-1]
    last = len(history) - 1
    alone = move.item in history.states(last) and history.is_only_one(last, move.item)
    if alone and history.shows_put(move) and _is_down(history, move):
        place = history.states(last)[move.target].type
        yield _candidate(QUESTION_TYPE, "Where is {} now?", (move.after,), [place], object_type)


def _origin(
    history: TrajectoryHistory, object_type: str, moves: tuple[ObjectMove, ...]
) -> Iterator[Candidate]:
    move = moves[0]
    if _shows_origin(history, move):
        when = "first picked it up" if history.pickups[move.item] > 1 else "picked it up"
        form = f"Where was {{}} before you {when}?"
        yield _candidate(FURTHER, form, (move.before,), [_start(history, move)], object_type)


def _destination(
    history: TrajectoryHistory, object_type: str, moves: tuple[ObjectMove, ...]
) -> Iterator[Candidate]:
    move = moves[0]
    if history.pickups[move.item] == 1 and history.shows_put(move):
        yield _candidate(
            FURTHER,
            "Where did you move {} to?",
            (move.after,),
            [history.target_type(move)],
            object_type,
        )


def _journey(
    history: TrajectoryHistory, object_type: str, moves: tuple[ObjectMove, ...]
) -> Iterator[Candidate]:
    first = moves[0]
    if not _shows_origin(history, first) or not all(history.shows_put(move) for move in moves):
        return
    places = [_start(history, first), *(history.target_type(move) for move in moves)]
    if candidates.are_distinguishable([place or "" for place in places]):
        clues = (first.before, *(move.after for move in moves))
        yield _candidate(
            FURTHER, "In which places was {}, from first to last?", clues, places, object_type
        )


def _start(history: TrajectoryHistory, move: ObjectMove) -> str | None:
    """Return the type of what an object was in or on before a move."""
    return None if move.origin is None else history.states(move.before)[move.origin].type


def _changes(history: TrajectoryHistory, move: ObjectMove) -> bool:
    """Return True if a move led to another type; else the question would contain the answer."""
    start = _start(history, move)
    return start is not None and canonical_type(start) != canonical_type(history.target_type(move))


def _is_down(history: TrajectoryHistory, move: ObjectMove) -> bool:
    """Return True if an object is still where its last move put it."""
    return history.parent(len(history) - 1, move.item) == move.target


def _shows_origin(history: TrajectoryHistory, move: ObjectMove) -> bool:
    """Return True if the frame before the pick-up shows the object there, alone of its type."""
    shown = move.origin is not None and history.shows(move.before, move.item, move.origin)
    return shown and history.is_alone_in_frame(move.before, move.item)


def _candidate(
    question_type: str,
    form: str,
    clues: tuple[int, ...],
    places: Sequence[str | None],
    object_type: str,
    named: str | None = None,
) -> Candidate:
    """Return a question on an object, and on a place, in words, if the form names one."""
    types = [place for place in places if place is not None]
    names = [with_the(object_type)]
    if named is not None:
        names.append(named)
    answers = tuple(map(answer_of, types))
    return Candidate(question_type, form, tuple(names), clues, answers, (object_type, *types))
