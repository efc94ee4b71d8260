"""Put action: "What object did you put in the fridge?"; further forms ask about several puts.

Table 3's form has two successive frames as clues: the object in the hand, and the object where it was put.
"""

from collections.abc import Iterator, Sequence

from infthor_eval.generation.questions.candidates import (
    MANY,
    Candidate,
    answer_of,
    are_distinguishable,
    further_type,
    in_or_on,
    listing_question,
)
from infthor_eval.generation.questions.history import ObjectMove, TrajectoryHistory

__all__ = ["FURTHER", "QUESTION_TYPE", "further_puts", "puts"]

QUESTION_TYPE = "put_action"
FURTHER = further_type(QUESTION_TYPE)


def puts(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the questions on what was put into a container, if there was only one put into any of its type."""
    for place_type, moves in sorted(_by_type(history).items()):
        (move, *others) = moves
        before = move.after - 1
        if not others and history.shows(before, move.item) and history.shows_put(move):
            names, subjects = (in_or_on(place_type),), (place_type, move.object_type)
            answers = (answer_of(move.object_type),)
            yield Candidate(
                QUESTION_TYPE, "What object did you put {}?", names, (before, move.after), answers, subjects
            )


def further_puts(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield questions on all objects put into one receptacle, if they are several, and on all puts."""
    for place_type, moves in sorted(_by_type(history).items()):
        if len(moves) > 1 and len({move.target for move in moves}) == 1:
            yield from _what(history, "What did you put {}?", (place_type,), moves)
    yield from _what(history, "What did you put down?", (), history.moves)
    yield from _where(history)


def _by_type(history: TrajectoryHistory) -> dict[str, list[ObjectMove]]:
    """Return the moves by the type of their target receptacle."""
    by_type: dict[str, list[ObjectMove]] = {}
    for move in history.moves:
        by_type.setdefault(history.states(move.after)[move.target].type, []).append(move)
    return by_type


def _what(
    history: TrajectoryHistory, form: str, places: tuple[str, ...], moves: Sequence[ObjectMove]
) -> Iterator[Candidate]:
    """Yield a question on the moved objects, with the frame after the first put of each."""
    first_puts = list({move.item: move for move in reversed(moves)}.values())[::-1]
    items = [move.object_type for move in first_puts]
    shown = all(history.shows_put(move) for move in first_puts)
    if shown and len(set(items)) == len(items) and 0 < len(items) <= MANY and are_distinguishable(items):
        answers = tuple(answer_of(item) for item in items)
        clues = tuple(move.after for move in first_puts)
        yield Candidate(FURTHER, form, tuple(map(in_or_on, places)), clues, answers, (*places, *items))


def _where(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the question on the types of receptacles that something was put into or onto."""
    yield from listing_question(
        FURTHER,
        "Where did you put things?",
        (
            (history.states(move.after)[move.target].type, move.after if history.shows_put(move) else None)
            for move in history.moves
        ),
    )
