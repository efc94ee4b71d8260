"""Object location tracing: where an object was, where it was moved, and where it is now.

It must be clear which pick-up or put is meant: "before you picked it up" is ambiguous for an object
picked up twice.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from infthor_eval.generation.questions import candidates
from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.history import ObjectMove, TrajectoryHistory
from infthor_eval.household.wording import answer_of, canonical_type, in_or_on, with_the

QUESTION_TYPE = "location_tracing"
FURTHER = candidates.further_type(QUESTION_TYPE)


def locations(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield questions on every object that is the only one of its type that was picked up."""
    for moved in _moved_objects(history):
        yield from moved.before_put()
        yield from moved.moved_from()
        yield from moved.now()


def further_locations(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield further questions on the same objects."""
    for moved in _moved_objects(history):
        yield from moved.origin()
        yield from moved.destination()
        yield from moved.journey()


def _moved_objects(history: TrajectoryHistory) -> "Iterator[_MovedObject]":
    for object_type, items in sorted(history.picked_up_by_type.items()):
        moves = history.moves_of(next(iter(items))) if len(items) == 1 else ()
        if moves:
            yield _MovedObject(history, object_type, moves)


@dataclass(frozen=True)
class _MovedObject:
    """An object that is the only one of its type that was picked up, and its moves."""

    history: TrajectoryHistory
    object_type: str
    moves: tuple[ObjectMove, ...]

    def before_put(self) -> Iterator[Candidate]:
        """Yield where it was before it was put into or onto something."""
        # Only for the first move, and only if no other leads to such a container: then there is
        # one place before it.
        move = self.moves[0]
        to = self.history.target_type(move)
        once = [self.history.target_type(other) for other in self.moves].count(to) == 1
        is_shown = self._shows_origin(move) and self.history.shows_put(move)
        if once and is_shown and self._changes(move):
            form = "Where was {} before you put it {}?"
            clues = (move.before, move.after)
            yield self._candidate(QUESTION_TYPE, form, clues, [self._start(move)], in_or_on(to))

    def moved_from(self) -> Iterator[Candidate]:
        """Yield where it was moved from something."""
        # Only for the last move, and only if no other starts at such a container: then there is
        # one place after it.
        move = self.moves[-1]
        is_shown = self._shows_origin(move) and self.history.shows_put(move)
        if not is_shown or not self._is_down(move):
            return
        origin = self._start(move)
        others = [self._start(other) for other in self.moves[:-1]]
        if origin is None or None in others:
            return
        if self._changes(move) and origin not in others:
            form = "Where did you move {} from {}?"
            clues = (move.before, move.after)
            places = [self.history.target_type(move)]
            yield self._candidate(QUESTION_TYPE, form, clues, places, with_the(origin))

    def now(self) -> Iterator[Candidate]:
        """Yield where it is in the end."""
        move = self.moves[-1]
        last = len(self.history) - 1
        states = self.history.states(last)
        alone = move.item in states and self.history.is_only_one(last, move.item)
        if alone and self.history.shows_put(move) and self._is_down(move):
            place = states[move.target].type
            yield self._candidate(QUESTION_TYPE, "Where is {} now?", (move.after,), [place])

    def origin(self) -> Iterator[Candidate]:
        """Yield where it was before it was picked up first."""
        move = self.moves[0]
        if self._shows_origin(move):
            is_again = self.history.pickups[move.item] > 1
            when = "first picked it up" if is_again else "picked it up"
            form = f"Where was {{}} before you {when}?"
            yield self._candidate(FURTHER, form, (move.before,), [self._start(move)])

    def destination(self) -> Iterator[Candidate]:
        """Yield where it was moved to, if it was moved once."""
        move = self.moves[0]
        if self.history.pickups[move.item] == 1 and self.history.shows_put(move):
            places = [self.history.target_type(move)]
            yield self._candidate(FURTHER, "Where did you move {} to?", (move.after,), places)

    def journey(self) -> Iterator[Candidate]:
        """Yield all places that it was at."""
        first = self.moves[0]
        if not self._shows_origin(first) or not all(map(self.history.shows_put, self.moves)):
            return
        places = [self._start(first), *map(self.history.target_type, self.moves)]
        if candidates.are_distinguishable([place or "" for place in places]):
            form = "In which places was {}, from first to last?"
            clues = (first.before, *(move.after for move in self.moves))
            yield self._candidate(FURTHER, form, clues, places)

    def _start(self, move: ObjectMove) -> str | None:
        """Return the type of what the object was in or on before a move."""
        return None if move.origin is None else self.history.states(move.before)[move.origin].type

    def _changes(self, move: ObjectMove) -> bool:
        """Return True if a move led to another type; else the question would contain the answer."""
        start = self._start(move)
        to = self.history.target_type(move)
        return start is not None and canonical_type(start) != canonical_type(to)

    def _is_down(self, move: ObjectMove) -> bool:
        """Return True if the object is still where its last move put it."""
        return self.history.parent(len(self.history) - 1, move.item) == move.target

    def _shows_origin(self, move: ObjectMove) -> bool:
        """Return True if the frame before the pick-up shows the object there, alone of its type."""
        shown = move.origin is not None and self.history.shows(move.before, move.item, move.origin)
        return shown and self.history.is_alone_in_frame(move.before, move.item)

    def _candidate(
        self,
        question_type: str,
        form: str,
        clues: tuple[int, ...],
        places: Sequence[str | None],
        named: str | None = None,
    ) -> Candidate:
        """Return a question on the object, and on a place, in words, if the form names one."""
        types = [place for place in places if place is not None]
        names = (with_the(self.object_type), *([] if named is None else [named]))
        answers = tuple(map(answer_of, types))
        return Candidate(question_type, form, names, clues, answers, (self.object_type, *types))
