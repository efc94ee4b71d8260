"""Movement counting: "How many times did you move the mug?" """

from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import Candidate, the
from infthor_eval.generation.questions.history import History

__all__ = ["KIND", "counts"]

KIND = "movement_counting"


def counts(history: History) -> Iterator[Candidate]:
    """One question on every object that alone of its type was handled; a move ends when it is put down."""
    for kind, items in sorted(history.handled.items()):
        moves = history.moves_of(next(iter(items))) if len(items) == 1 else ()
        if moves and all(history.shows(move.after, move.item, move.target) for move in moves):
            text = f"How many times did you pick up {the(kind)} and put it down again?"
            yield Candidate(KIND, text, tuple(move.after for move in moves), (str(len(moves)),), (kind,))
