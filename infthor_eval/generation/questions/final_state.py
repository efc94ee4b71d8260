"""Final object state, in Table 3's words: is it in, what is in, how many were in; as things are at the end."""

from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import (
    MANY,
    Candidate,
    answer_of,
    are_distinguishable,
    in_or_on,
    with_the,
)
from infthor_eval.generation.questions.evidence import minimal_cover
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.questions.readings import is_plain
from infthor_eval.household.wording import canonical_type

__all__ = ["QUESTION_TYPE", "final_states"]

QUESTION_TYPE = "final_state"


def final_states(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Questions on receptacles that the agent put something into and that alone are of their type."""
    last = len(history) - 1
    targets = sorted({move.target for move in history.moves})
    singles = [key for key in targets if key in history.world(last) and history.only_one(last, key)]
    for key in singles:
        yield from _inside(history, key)
        yield from _what(history, key)


def _inside(history: TrajectoryHistory, receptacle: str) -> Iterator[Candidate]:
    """Whether a moved object is in it in the end: yes where it was put there last, no where it was taken away."""
    last = len(history) - 1
    world = history.world(last)
    for item in sorted({move.item for move in history.moves if receptacle in {move.target, move.origin}}):
        move = history.moves_of(item)[-1]
        here = history.parent(last, item)
        alone = item in world and history.only_one(last, item) and len(history.handled[move.object_type]) == 1
        if not alone or here != move.target:
            continue
        if history.shows_put(move):
            place_type = world[receptacle].type
            names, subjects = (with_the(world[item].type), in_or_on(place_type)), (world[item].type, place_type)
            answer = "yes" if here == receptacle else "no"
            yield Candidate(QUESTION_TYPE, "Is {} {}?", names, (move.after,), (answer,), subjects)


def _what(history: TrajectoryHistory, receptacle: str) -> Iterator[Candidate]:
    """What is in it in the end, and how many things."""
    last = len(history) - 1
    world = history.world(last)
    inside = history.contents(last, receptacle)
    since = {item: _arrival(history, item, receptacle) for item in inside}
    shown = {}
    for frame in range(min(since.values(), default=0), len(history)):
        here = history.contents(frame, receptacle)
        held = {key for key in here if key in history.seen(frame)}
        # A frame that shows something there that left later, even if it came back, tells another story.
        stays = held <= inside and all(frame >= since[key] for key in held)
        if history.shows(frame, receptacle) and stays:
            shown[frame] = frozenset(key for key in held if history.shows_inside(frame, key))
    clues = minimal_cover(inside, shown, lambda frame, keys: history.clearness(frame, *keys)) if inside else None
    if clues is None or len(inside) > MANY or not is_plain(history, last, receptacle):
        return
    place_type = world[receptacle].type
    types = sorted(world[key].type for key in inside)
    where, count = (in_or_on(place_type),), str(len(inside))
    yield Candidate(QUESTION_TYPE, "How many objects were {}?", where, clues, (count,), (place_type, "#"))
    if len({canonical_type(item) for item in types}) == len(types) and are_distinguishable(types):
        answers = tuple(answer_of(item) for item in types)
        yield Candidate(QUESTION_TYPE, "What objects are {}?", where, clues, answers, (place_type, *types))


def _arrival(history: TrajectoryHistory, item: str, receptacle: str) -> int:
    """The frame from which on the object stays in the receptacle."""
    frame = len(history) - 1
    while frame > 0 and history.is_inside(frame - 1, item, receptacle):
        frame -= 1
    return frame
