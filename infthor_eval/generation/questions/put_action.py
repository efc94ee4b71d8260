"""Put action: "What did you put in the fridge?" """

from collections.abc import Iterator

from infthor_eval.generation.affordances import preposition
from infthor_eval.generation.questions.candidates import Candidate, answer_of, distinct, the
from infthor_eval.generation.questions.history import History, Move

__all__ = ["KIND", "puts"]

KIND = "put_action"


def puts(history: History) -> Iterator[Candidate]:
    """One question for every receptacle type of which one instance alone was put into."""
    by_kind: dict[str, list[Move]] = {}
    for move in history.moves:
        by_kind.setdefault(history.world(move.after)[move.target].type, []).append(move)
    for kind, moves in sorted(by_kind.items()):
        first_puts = list({move.item: move for move in reversed(moves)}.values())[::-1]
        items = [move.kind for move in first_puts]
        one_target = len({move.target for move in moves}) == 1
        shown = all(history.shows(move.after, move.item, move.target) for move in first_puts)
        if one_target and shown and len(set(items)) == len(items) and distinct(items):
            text = f"What did you put {preposition(kind)} {the(kind)}?"
            answers = tuple(answer_of(item) for item in items)
            clues = tuple(move.after for move in first_puts)
            yield Candidate(KIND, text, clues, answers, (kind, *items))
