"""Movement counting: how often something was moved; further: openings, puts, different objects.

The clues of Table 3's form are one frame per counted event, so the number of clue frames alone
gives the answer away. The further questions therefore have frames without an event among their
clues: 8 frames in all for answers up to 7, 16 for answers up to 15, and so on.
"""

import random
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace

from infthor_eval.generation.questions.candidates import Candidate, further_type, in_or_on, with_the
from infthor_eval.generation.questions.history import Event, ObjectMove, TrajectoryHistory
from infthor_eval.household.wording import noun, with_article

__all__ = ["FURTHER", "QUESTION_TYPE", "counts", "further_counts"]

QUESTION_TYPE = "movement_counting"
FURTHER = further_type(QUESTION_TYPE)
_FRAMES = 8  # of a further question whose answer is smaller


def counts(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the questions on how often an object was moved, picked up more than once and put down.

    It must be the only object of its type that was picked up, or the name would be ambiguous.
    """
    for object_type, items in sorted(history.picked_up_by_type.items()):
        item = min(items)
        moves = history.moves_of(item)
        is_shown = all(history.shows(move.after, move.item, move.target) for move in moves)
        if len(items) == 1 and is_shown and len(moves) == history.pickups[item] > 1:
            form = "How many times did you move {}?"
            frames = [move.after for move in moves]
            yield _count(QUESTION_TYPE, form, (with_the(object_type),), frames, object_type)


def further_counts(history: TrajectoryHistory, rng: random.Random) -> Iterator[Candidate]:
    """Yield all other counts, with frames without an event, chosen at random, among their clues."""
    idle = sorted(set(range(1, len(history))) - {event.frame for event in history.events})
    for candidate in (*_openings(history), *_puts(history), *_items(history)):
        n_added = _number_of_frames(len(candidate.clues)) - len(candidate.clues)
        if n_added <= len(idle):
            yield replace(
                candidate, clues=tuple(sorted({*candidate.clues, *rng.sample(idle, n_added)}))
            )


def _number_of_frames(count: int) -> int:
    number = _FRAMES
    while number <= count:
        number *= 2
    return number


def _openings(history: TrajectoryHistory) -> Iterator[Candidate]:
    # By type: "the fridge" if there is one, "a drawer" if there are several.
    by_type: dict[str, list[Event]] = defaultdict(list)
    for event in history.events:
        if event.action == "OpenObject":
            by_type[event.object_type].append(event)
    for object_type, events in sorted(by_type.items()):
        if all(history.shows(event.frame, event.target) for event in events):
            single = all(history.is_only_one(event.frame, event.target) for event in events)
            name = with_the(object_type) if single else with_article(noun(object_type))
            frames = [event.frame for event in events]
            yield _count(FURTHER, "How many times did you open {}?", (name,), frames, object_type)


def _puts(history: TrajectoryHistory) -> Iterator[Candidate]:
    # Only for receptacles that are the only ones of their types.
    by_target: dict[str, list[ObjectMove]] = defaultdict(list)
    for move in history.moves:
        by_target[move.target].append(move)
    for target, moves in sorted(by_target.items()):
        is_shown = all(history.shows_put(move) for move in moves)
        if is_shown and all(history.is_only_one(move.after, target) for move in moves):
            place_type = history.target_type(moves[0])
            frames = [move.after for move in moves]
            form = "How many times did you put something {}?"
            yield _count(FURTHER, form, (in_or_on(place_type),), frames, place_type)


def _items(history: TrajectoryHistory) -> Iterator[Candidate]:
    # The clues are the frames in which each object is held for the first time.
    first: dict[str, int] = {}
    for event in history.events:
        if event.action == "PickupObject":
            first.setdefault(event.target, event.frame)
    if first and all(history.shows(frame, item) for item, frame in first.items()):
        yield _count(
            FURTHER, "How many different objects did you pick up?", (), sorted(first.values()), "#"
        )


def _count(
    question_type: str, form: str, names: tuple[str, ...], frames: list[int], subject: str
) -> Candidate:
    return Candidate(question_type, form, names, tuple(frames), (str(len(frames)),), (subject,))
