"""Movement counting: how often something was moved; further: openings, puts, different objects.

The clues of Table 3's form are one frame per counted event, so the number of clue frames alone
gives the answer away. The further questions therefore have clues without an event: 8 in all for
answers up to 7, 16 for answers up to 15, and so on. Only two successive frames show that something
was opened or put, so there each clue is two frames, those without an event, too.
"""

import random
from collections.abc import Iterator, Sequence
from dataclasses import replace

from infthor_eval.generation.questions.candidates import Candidate, further_type
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.grouping import grouped
from infthor_eval.household.wording import in_or_on, noun, with_article, with_the

QUESTION_TYPE = "movement_counting"
FURTHER = further_type(QUESTION_TYPE)
ALL = "#"  # the subject of a count of all objects, which is about no type
_CLUES = 8  # of a further question whose answer is smaller


def counts(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the questions on how often an object was moved, picked up more than once and put down.

    It must be the only object of its type that was picked up, or the name would be ambiguous.
    """
    for object_type, items in sorted(history.picked_up_by_type.items()):
        item = min(items)
        moves = history.moves_of(item)
        is_shown = all(history.shows_put(move) for move in moves)
        if len(items) == 1 and is_shown and len(moves) == history.pickups[item] > 1:
            form = "How many times did you move {}?"
            frames = [move.after for move in moves]
            yield _count(QUESTION_TYPE, form, (with_the(object_type),), frames, object_type)


def further_counts(history: TrajectoryHistory, rng: random.Random) -> Iterator[Candidate]:
    """Yield all other counts, with clues without an event, chosen at random, among theirs."""
    for candidate in (*_openings(history), *_puts(history)):
        yield from _with_idle_clues(history, candidate, 2, rng)
    for candidate in _items(history):
        yield from _with_idle_clues(history, candidate, 1, rng)


def _with_idle_clues(
    history: TrajectoryHistory, candidate: Candidate, length: int, rng: random.Random
) -> Iterator[Candidate]:
    """Yield a count with clues of so many frames without an event, unless there are too few."""
    count = len(candidate.clues) // length
    number = _CLUES
    while number <= count:
        number *= 2
    taken = {event.frame for event in history.events} | set(candidate.clues)
    starts = list(range(1, len(history) - length + 1))
    rng.shuffle(starts)
    for start in starts:
        frames = range(start, start + length)
        if count == number:
            break
        if taken.isdisjoint(frames):
            taken.update(frames)
            candidate = replace(candidate, clues=tuple(sorted({*candidate.clues, *frames})))
            count += 1
    if count == number:
        yield candidate


def _openings(history: TrajectoryHistory) -> Iterator[Candidate]:
    # By type: "the fridge" if there is one, "a drawer" if there are several.
    opened = (event for event in history.events if event.action == "OpenObject")
    by_type = grouped((event.object_type, event) for event in opened)
    for object_type, events in sorted(by_type.items()):
        single = all(history.is_only_one(event.frame, event.target) for event in events)
        name = with_the(object_type) if single else with_article(noun(object_type))
        form = "How many times did you open {}?"
        shown = [history.opening_clues(event) for event in events]
        yield from _count_pairs(form, name, shown, object_type)


def _puts(history: TrajectoryHistory) -> Iterator[Candidate]:
    # Only for receptacles that are the only ones of their types.
    by_target = grouped((move.target, move) for move in history.moves)
    for target, moves in sorted(by_target.items()):
        if all(history.is_only_one(move.after, target) for move in moves):
            place_type = history.target_type(moves[0])
            form = "How many times did you put something {}?"
            shown = [history.put_clues(move) for move in moves]
            yield from _count_pairs(form, in_or_on(place_type), shown, place_type)


def _items(history: TrajectoryHistory) -> Iterator[Candidate]:
    # The clues are the frames in which each object is held for the first time. Two of a type look
    # alike, so nobody could tell whether they were two.
    first: dict[str, int] = {}
    for event in history.events:
        if event.action == "PickupObject":
            first.setdefault(event.target, event.frame)
    are_alike = any(len(items) > 1 for items in history.picked_up_by_type.values())
    is_shown = all(history.shows(frame, item) for item, frame in first.items())
    if first and is_shown and not are_alike:
        yield _count(
            FURTHER, "How many different objects did you pick up?", (), sorted(first.values()), ALL
        )


def _count_pairs(
    form: str, name: str, pairs: Sequence[tuple[int, int] | None], subject: str
) -> Iterator[Candidate]:
    """Yield a count of events of which each is shown by two frames, if all are."""
    shown = [pair for pair in pairs if pair is not None]
    if len(shown) == len(pairs):
        clues = tuple(frame for pair in shown for frame in pair)
        yield Candidate(FURTHER, form, (name,), clues, (str(len(shown)),), (subject,))


def _count(
    question_type: str, form: str, names: tuple[str, ...], frames: list[int], subject: str
) -> Candidate:
    return Candidate(question_type, form, names, tuple(frames), (str(len(frames)),), (subject,))
