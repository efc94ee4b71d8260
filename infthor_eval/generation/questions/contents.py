"""Slicing and container content: what was sliced, and what a receptacle held, and when.

Table 3's forms do not define which objects count as being in or on something, so they are used only
where every reading gives the same answer (see `readings`). Our forms define it: objects that can be
picked up and are directly there.
"""

from collections import Counter
from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import Candidate, further_type, type_question
from infthor_eval.generation.questions.history import Event, TrajectoryHistory, is_same_object
from infthor_eval.generation.questions.readings import can_be_picked_up, is_plain, minimal_cover
from infthor_eval.household.wording import canonical_type, in_or_on, with_the

CONTENT = "container_content"
FURTHER = further_type(CONTENT)
SLICING = "slicing"
# They take objects of one type alone (AI2-THOR's list of what fits where), so their contents need
# no look.
_OF_ONE_TYPE = {
    "CoffeeMachine", "HandTowelHolder", "PaintingHanger", "Toaster", "ToiletPaperHanger",
    "TowelHolder",
}  # fmt: skip
FormAndNames = tuple[str, tuple[str, ...]]


def slicings(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the question on what the agent sliced."""
    sliced = {event.target: event for event in history.events if event.action == "SliceObject"}
    seen_at = {
        event.frame: frozenset(key for key in sliced if history.shows_slices(event.frame, key))
        for event in sliced.values()
    }
    # A later frame may show the slices of the one before, too, which then needs none.
    clues = minimal_cover(sliced.keys(), seen_at, lambda frame, _: -frame)
    if clues:
        types = [event.object_type for event in sliced.values()]
        yield from type_question(SLICING, "What did you slice?", (), clues, types)


def at_slicing(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the questions on what was where something was sliced, including the sliced object."""
    events = [event for event in history.events if event.action == "SliceObject"]
    count = Counter(event.object_type for event in events)
    for event in events:
        receptacle = history.parent(event.frame - 1, event.target)
        # With two slicings of a type it would be ambiguous which one is meant.
        if (
            count[event.object_type] > 1
            or receptacle is None
            or not is_plain(history, event.frame, receptacle)
        ):
            continue
        inside = history.contents(event.frame, receptacle)
        slices = sorted(
            key
            for key in inside
            if key.startswith(f"{event.target}|") and history.shows(event.frame, key)
        )
        others = frozenset(key for key in inside if not key.startswith(f"{event.target}|"))
        if slices and others:
            receptacle_type = history.states(event.frame)[receptacle].type
            wording = (
                "What objects were {} when you sliced {}?",
                (in_or_on(receptacle_type), with_the(event.object_type)),
            )
            frames = _unchanged_frames(history, event.frame, receptacle)
            # One slice stands for the sliced object: all of them together would need more clues.
            yield from _contents_question(
                history, SLICING, wording, frames, receptacle, others | {slices[0]}
            )


def contents(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the questions on the only receptacles of their types whose contents never change.

    A receptacle that takes one type of object alone is left out: its contents can be told without a
    frame.
    """
    last = len(history) - 1
    receptacles = {
        parent for key in history.states(last) if (parent := history.parent(last, key)) is not None
    }
    for receptacle in sorted(receptacles):
        frames = _unchanged_frames(history, 0, receptacle)
        receptacle_type = history.states(last)[receptacle].type
        is_constant = len(frames) == len(history) and receptacle_type not in _OF_ONE_TYPE
        if (
            is_constant
            and history.is_only_one(last, receptacle)
            and is_plain(history, last, receptacle)
        ):
            wording = "What objects were {}?", (in_or_on(receptacle_type),)
            yield from _contents_question(
                history, CONTENT, wording, frames, receptacle, history.contents(last, receptacle)
            )


def at_opening(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the questions on what was in the only receptacle of its type at its first opening."""
    opened: set[str] = set()
    for event in history.events:
        first = event.action == "OpenObject" and event.target not in opened
        opened |= {event.target} if event.action == "OpenObject" else set()
        if first and history.is_only_one(event.frame, event.target):
            form = "Which things that can be picked up were directly {} when you first opened it?"
            wording = form, (in_or_on(event.object_type),)
            yield from _loose_contents_question(history, wording, event, event.target)


def at_pickup(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the questions on what was left where something was picked up."""
    events = [event for event in history.events if event.action == "PickupObject"]
    count = Counter(event.object_type for event in events)
    for event in events:
        receptacle = history.parent(event.frame - 1, event.target)
        is_once = count[event.object_type] == 1
        if is_once and receptacle is not None and receptacle in history.states(event.frame):
            receptacle_type = history.states(event.frame)[receptacle].type
            form = (
                "Which other things that can be picked up were directly {} when you picked up {} "
                "from it?"
            )
            wording = form, (in_or_on(receptacle_type), with_the(event.object_type))
            yield from _loose_contents_question(history, wording, event, receptacle)


def _loose_contents_question(
    history: TrajectoryHistory, wording: FormAndNames, event: Event, receptacle: str
) -> Iterator[Candidate]:
    """Yield a question on the contents of a receptacle right after an event that can be picked up.

    One of the clues shows the event: without it, nobody could tell that the others show what was
    there then.
    """
    items = can_be_picked_up(history, event.frame, history.contents(event.frame, receptacle))
    if items is not None and history.shows(event.frame, event.target):
        frames = _unchanged_frames(history, event.frame, receptacle)
        yield from _contents_question(
            history, FURTHER, wording, frames, receptacle, items, event=event
        )


def _unchanged_frames(history: TrajectoryHistory, first: int, receptacle: str) -> range:
    """Return the frames from `first` on during which the contents of a receptacle do not change."""
    inside = history.contents(first, receptacle)
    changed = (
        frame
        for frame in range(first, len(history))
        if history.contents(frame, receptacle) != inside
    )
    return range(first, next(changed, len(history)))


def _contents_question(
    history: TrajectoryHistory,
    question_type: str,
    wording: FormAndNames,
    frames: range,
    receptacle: str,
    items: frozenset[str],
    *,
    event: Event | None = None,
) -> Iterator[Candidate]:
    """Yield a question on objects in a receptacle, with the frames that show them there.

    Args:
        history: the trajectory.
        question_type: type of the question.
        wording: its form, and the names in it.
        frames: frames during which the contents are the same.
        receptacle: its id.
        items: ids of the objects.
        event: the event before the first of the frames, if a clue must show it: that frame, or a
            later one in which its object is still in the hand, or open.
    """
    seen_at = {}
    for frame in frames:
        is_ambiguous = _shows_similar_contents(history, frame, receptacle)
        if history.shows(frame, receptacle) and not is_ambiguous:
            seen_at[frame] = frozenset(key for key in items if history.shows_inside(frame, key))
    if event is not None and frames[0] not in seen_at:
        return
    first = set[int]() if event is None else {frames[0]}
    missing = items.difference(*map(seen_at.__getitem__, first))
    if not items:
        return
    cover = minimal_cover(missing, seen_at, lambda frame, keys: history.clarity(frame, *keys))
    if cover is not None:
        shown = set[str]().union(*map(seen_at.__getitem__, cover))
        if event and items <= shown and any(_shows_still(history, f, event) for f in cover):
            first = set()
        clues = tuple(sorted(first.union(cover)))
        types = sorted(_whole_types(history, frames[0], items))
        receptacle_type = history.states(frames[0])[receptacle].type
        yield from type_question(question_type, *wording, clues, types, (receptacle_type,))


def _shows_still(history: TrajectoryHistory, frame: int, event: Event) -> bool:
    """Return True if a frame shows the object of an event as that left it, held or open."""
    if not history.shows(frame, event.target):
        return False
    now, left = (history.states(number)[event.target] for number in (frame, event.frame))
    return now.held == left.held and now.is_open == left.is_open


def _whole_types(history: TrajectoryHistory, frame: int, keys: frozenset[str]) -> list[str]:
    """Return the types of objects; a slice that was cut at this frame has the type of the whole."""
    states = history.states(frame)
    sliced = {
        event.target
        for event in history.events
        if event.action == "SliceObject" and event.frame == frame
    }
    fresh = {key for key in keys for whole in sliced if key.startswith(f"{whole}|")}
    return [
        states[key].type.removesuffix("Sliced") if key in fresh else states[key].type
        for key in keys
    ]


def _shows_similar_contents(history: TrajectoryHistory, frame: int, receptacle: str) -> bool:
    """Return True if a frame shows contents of another receptacle with the same name."""
    states = history.states(frame)
    object_type = canonical_type(states[receptacle].type)
    for key in history.objects_in_frame(frame):
        parent = history.parent(frame, key)
        if parent is None or is_same_object(parent, receptacle):
            continue
        if canonical_type(states[parent].type) == object_type:
            return True
    return False
