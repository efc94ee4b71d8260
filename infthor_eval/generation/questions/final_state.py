"""Final object state, in Table 3's forms: is an object in a receptacle, what is, how many are."""

from collections.abc import Iterator
from itertools import combinations

from infthor_eval.generation.questions.candidates import MANY, Candidate, type_question
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.questions.readings import is_plain, minimal_cover
from infthor_eval.household.wording import in_or_on, with_the

QUESTION_TYPE = "final_state"
COUNT_FORM = "How many objects were {}?"


def final_states(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield questions on the only receptacles of their types, if the agent put something there."""
    last = len(history) - 1
    targets = sorted({move.target for move in history.moves})
    singles = [
        key for key in targets if key in history.states(last) and history.is_only_one(last, key)
    ]
    for key in singles:
        yield from _inside(history, key)
        yield from _what(history, key)


def _inside(history: TrajectoryHistory, receptacle: str) -> Iterator[Candidate]:
    """Yield questions on whether an object that was put in or taken out is there in the end."""
    last = len(history) - 1
    states = history.states(last)
    moved = {move.item for move in history.moves if receptacle in {move.target, move.origin}}
    for item in sorted(moved):
        move = history.moves_of(item)[-1]
        here = history.parent(last, item)
        alone = item in states and history.is_only_one(last, item)
        if not alone or len(history.picked_up_by_type[move.object_type]) > 1:
            continue  # ambiguous
        if here == move.target and history.shows_put(move):  # still where the last clue shows it
            receptacle_type = states[receptacle].type
            names = (with_the(states[item].type), in_or_on(receptacle_type))
            subjects = (states[item].type, receptacle_type)
            answer = "yes" if here == receptacle else "no"
            yield Candidate(QUESTION_TYPE, "Is {} {}?", names, (move.after,), (answer,), subjects)


def _what(history: TrajectoryHistory, receptacle: str) -> Iterator[Candidate]:
    """Yield the questions on what is in the receptacle in the end, and how many objects."""
    last = len(history) - 1
    states = history.states(last)
    inside = history.contents(last, receptacle)
    if not inside or len(inside) > MANY or not is_plain(history, last, receptacle):
        return
    since = {item: _arrival(history, item, receptacle) for item in inside}
    shown = {}
    for frame in range(min(since.values(), default=0), len(history)):
        here = history.contents(frame, receptacle)
        held = {key for key in here if key in history.objects_in_frame(frame)}
        # Frames with an object that left later, even if it returned, would be evidence for another
        # answer.
        is_final = held <= inside and all(frame >= since[key] for key in held)
        if history.shows(frame, receptacle) and is_final:
            shown[frame] = frozenset(key for key in held if history.shows_inside(frame, key))
    clues = minimal_cover(inside, shown, lambda frame, keys: history.clarity(frame, *keys))
    if clues is None:
        return
    receptacle_type = states[receptacle].type
    types = sorted(states[key].type for key in inside)
    where = (in_or_on(receptacle_type),)
    if _can_be_counted(history, clues, inside):
        count = str(len(inside))
        yield Candidate(QUESTION_TYPE, COUNT_FORM, where, clues, (count,), (receptacle_type, "#"))
    form = "What objects are {}?"
    yield from type_question(QUESTION_TYPE, form, where, clues, types, (receptacle_type,))


def _can_be_counted(
    history: TrajectoryHistory, clues: tuple[int, ...], items: frozenset[str]
) -> bool:
    """Return True if no two objects are of one type, or a clue shows the two side by side."""
    states = history.states(len(history) - 1)
    return all(
        states[one].type != states[other].type
        or any(history.shows_apart(frame, one, other) for frame in clues)
        for one, other in combinations(sorted(items), 2)
    )


def _arrival(history: TrajectoryHistory, item: str, receptacle: str) -> int:
    """Return the frame from which on the object stays in the receptacle."""
    frame = len(history) - 1
    while frame > 0 and history.is_inside(frame - 1, item, receptacle):
        frame -= 1
    return frame
