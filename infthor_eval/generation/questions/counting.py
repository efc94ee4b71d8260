"""Movement counting: how often something was moved, and how often a door or a drawer was."""

from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import Candidate, the
from infthor_eval.generation.questions.history import History

__all__ = ["KIND", "counts"]

KIND = "movement_counting"


def counts(history: History) -> Iterator[Candidate]:
    """One question on every object that alone of its type was handled, and on every receptacle that was opened."""
    yield from _moves(history)
    yield from _openings(history)


def _moves(history: History) -> Iterator[Candidate]:
    """A move ends when the object is put down."""
    for kind, items in sorted(history.handled.items()):
        moves = history.moves_of(next(iter(items))) if len(items) == 1 else ()
        if moves and all(history.shows(move.after, move.item, move.target) for move in moves):
            text = f"How many times did you pick up {the(kind)} and put it down again?"
            yield Candidate(KIND, text, tuple(move.after for move in moves), (str(len(moves)),), (kind,))


def _openings(history: History) -> Iterator[Candidate]:
    """Of receptacles that alone are of their type."""
    opened: dict[str, list[int]] = {}
    for event in history.events:
        if event.action == "OpenObject" and history.only_one(event.frame, event.target):
            opened.setdefault(event.target, []).append(event.frame)
    for key, frames in sorted(opened.items()):
        if all(history.shows(frame, key) for frame in frames):
            kind = history.world(frames[0])[key].type
            text = f"How many times did you open {the(kind)}?"
            yield Candidate(KIND, text, tuple(frames), (str(len(frames)),), (kind,))
