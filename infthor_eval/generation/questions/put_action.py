"""Put action: "What did you put in the fridge?", "What did you put down?", "Where did you put things?" """

from collections.abc import Iterator, Sequence

from infthor_eval.generation.questions.candidates import MANY, Candidate, answer_of, distinct, listing, within
from infthor_eval.generation.questions.history import History, Move

__all__ = ["QUESTION_TYPE", "puts"]

QUESTION_TYPE = "put_action"


def puts(history: History) -> Iterator[Candidate]:
    """One question for every receptacle type of which one instance alone was put into, and one on all of them."""
    by_type: dict[str, list[Move]] = {}
    for move in history.moves:
        by_type.setdefault(history.world(move.after)[move.target].type, []).append(move)
    for place_type, moves in sorted(by_type.items()):
        if len({move.target for move in moves}) == 1:
            yield from _what(history, "What did you put {}?", (place_type,), moves)
    yield from _what(history, "What did you put down?", (), history.moves)
    yield from _where(history)


def _what(history: History, form: str, places: tuple[str, ...], moves: Sequence[Move]) -> Iterator[Candidate]:
    """Which objects were moved, each with the frame after its first put."""
    first_puts = list({move.item: move for move in reversed(moves)}.values())[::-1]
    items = [move.object_type for move in first_puts]
    shown = all(history.shows_put(move) for move in first_puts)
    if shown and len(set(items)) == len(items) and 0 < len(items) <= MANY and distinct(items):
        answers = tuple(answer_of(item) for item in items)
        clues = tuple(move.after for move in first_puts)
        yield Candidate(QUESTION_TYPE, form, tuple(map(within, places)), clues, answers, (*places, *items))


def _where(history: History) -> Iterator[Candidate]:
    """The places that something was put into or onto."""
    yield from listing(
        QUESTION_TYPE,
        "Where did you put things?",
        (
            (history.world(move.after)[move.target].type, move.after if history.shows_put(move) else None)
            for move in history.moves
        ),
    )
