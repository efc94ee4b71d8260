"""Answering questions by their text, from the facts of frames, for the independent check.

The solvers do not know how a question was generated and share no code with the rules, so they do
not share their errors.
"""

import re
from collections.abc import Callable, Sequence
from itertools import pairwise

from infthor_eval.generation.questions.facts import (
    FrameFacts,
    events_of,
    holder_of,
    ids_inside,
    is_of_type,
    named_type,
    only_loose,
    place_of,
    plain_name,
    target_is,
    target_name,
    whole_id,
)

__all__ = ["answer"]


def answer(text: str, facts: Sequence[FrameFacts]) -> list[str] | None:
    """Return the answers to a question, or None if the facts are not sufficient."""
    for pattern, solve in _SOLVERS:
        match = re.fullmatch(pattern, text)
        if match is not None and facts:
            return solve(facts, *match.groups()) or None
    return None


def _handled_object(facts: Sequence[FrameFacts], words: str) -> str | None:
    """Return the object of a type that is acted on, or else the only known one."""
    acted = {
        frame.target
        for frame in facts
        if frame.target in frame.objects and is_of_type(frame.objects[frame.target], words)
    }
    known = {
        key for frame in facts for key, state in frame.objects.items() if is_of_type(state, words)
    }
    candidates = acted or known
    return next(iter(candidates)) if len(candidates) == 1 else None


def _track(facts: Sequence[FrameFacts], words: str) -> list[tuple[FrameFacts, str]]:
    """Return where the handled object of a type is, at each frame at which that is known."""
    key = _handled_object(facts, words)
    if key is None:
        return []
    known = [(frame, place_of(frame, key)) for frame in facts if key in frame.objects]
    return [(frame, place) for frame, place in known if place is not None]


def _presence(facts: Sequence[FrameFacts], words: str) -> list[str]:
    states = [state for frame in facts for state in frame.objects.values()]
    return ["yes" if any(is_of_type(state, words) for state in states) else "no"]


def _seen(facts: Sequence[FrameFacts], words: str) -> list[str]:
    words = re.sub(r"^an? ", "", words)
    shown = (frame.objects[key] for frame in facts for key in frame.in_frame & frame.objects.keys())
    return ["yes" if any(is_of_type(state, words) for state in shown) else "no"]


def _before(facts: Sequence[FrameFacts], words: str, first: str | None) -> list[str]:
    picked = [frame.number for frame in events_of(facts, "PickupObject", words)]
    if len(picked) > 1 and not first:
        return []  # ambiguous
    places = [
        place for frame, place in _track(facts, words) if not picked or frame.number < picked[0]
    ]
    return places[-1:]


def _before_put(facts: Sequence[FrameFacts], words: str, place: str) -> list[str]:
    """Return where it was before the only put into a place, if that was only one place."""
    track = _track(facts, words)
    puts = {frame.number for frame in events_of(facts, "PutObject", words)}
    there = [
        frame.number for frame, name in track if frame.number in puts and name == named_type(place)
    ]
    before = {name for frame, name in track if there and frame.number < there[0]}
    return list(before) if len(there) == len(before) == 1 else []


def _moved_from(facts: Sequence[FrameFacts], words: str, place: str) -> list[str]:
    """Return where it went from a place, if it left that place once and then stayed."""
    places = _journey(facts, words)
    start = named_type(place)
    return places[-1:] if places[-2:-1] == [start] and places.count(start) == 1 else []


def _moved_to(facts: Sequence[FrameFacts], words: str) -> list[str]:
    puts = {frame.number for frame in events_of(facts, "PutObject", words)}
    return [place for frame, place in _track(facts, words) if frame.number in puts][-1:]


def _now(facts: Sequence[FrameFacts], words: str) -> list[str]:
    return [place for _, place in _track(facts, words)][-1:]


def _journey(facts: Sequence[FrameFacts], words: str) -> list[str]:
    places = [place for _, place in _track(facts, words)]
    return places[:1] + [place for previous, place in pairwise(places) if place != previous]


def _puts_at(facts: Sequence[FrameFacts], place: str, words: str | None = None) -> list[FrameFacts]:
    """Return the facts right after puts (of a type of object) into a type of receptacle."""
    events = [
        frame for frame in events_of(facts, "PutObject", words) if frame.target in frame.objects
    ]
    return [frame for frame in events if place_of(frame, frame.target or "") == named_type(place)]


def _put_into(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    return list({frame.target: target_name(frame) for frame in _puts_at(facts, place)}.values())


def _put_object(facts: Sequence[FrameFacts], _preposition: str, words: str) -> list[str]:
    """Return what is in the hand at one frame and in or on a receptacle at the next."""
    names = []
    for previous, frame in pairwise(facts):
        target = frame.target or ""
        if frame.action != "PutObject" or target not in frame.objects:
            continue
        was_held = target in previous.objects and previous.objects[target].held
        if was_held and place_of(frame, target) == named_type(words):
            names.append(target_name(frame))
    return names


def _put_down(facts: Sequence[FrameFacts]) -> list[str]:
    puts = events_of(facts, "PutObject")
    known = [frame for frame in puts if place_of(frame, frame.target or "") is not None]
    return list({frame.target: target_name(frame) for frame in known}.values())


def _put_places(facts: Sequence[FrameFacts]) -> list[str]:
    places = (place_of(frame, frame.target or "") for frame in events_of(facts, "PutObject"))
    return list(dict.fromkeys(place for place in places if place is not None))


def _opened_types(facts: Sequence[FrameFacts]) -> list[str]:
    return list(dict.fromkeys(target_name(frame) for frame in events_of(facts, "OpenObject")))


def _open(frame: FrameFacts, words: str) -> list[str]:
    named = [state for state in frame.objects.values() if is_of_type(state, words)]
    states = [state for state in named if state.is_open is not None]
    return ["yes" if states[0].is_open else "no"] if len(states) == 1 else []


def _ever_open(facts: Sequence[FrameFacts], words: str) -> list[str]:
    known = {answer for frame in facts for answer in _open(frame, words)}
    return [max(known)] if known else []  # "yes" is the later word


def _open_now(facts: Sequence[FrameFacts], words: str) -> list[str]:
    known = [answers for frame in facts if (answers := _open(frame, words))]
    return known[-1] if known else []


def _open_then(facts: Sequence[FrameFacts], words: str, verb: str, item: str) -> list[str]:
    actions = {"picked up": "PickupObject", "sliced": "SliceObject", "turned on": "ToggleObjectOn"}
    events = events_of(facts, actions[verb], item)
    return _open(events[0], words) if len(events) == 1 else []


def _open_at_put(
    facts: Sequence[FrameFacts], words: str, item: str, _preposition: str, place: str
) -> list[str]:
    events = _puts_at(facts, place, item)
    return _open(events[0], words) if len(events) == 1 else []


def _sliced_types(facts: Sequence[FrameFacts]) -> list[str]:
    return [target_name(frame) for frame in events_of(facts, "SliceObject")]


def _at_slicing(facts: Sequence[FrameFacts], _preposition: str, place: str, item: str) -> list[str]:
    names = _left_at(facts, "SliceObject", place, item)
    whole = named_type(item)
    return sorted({whole if name == f"{whole}sliced" else name for name in names})


def _at_opening(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    events = events_of(facts, "OpenObject", place)
    if not events:
        return []  # nothing shows when that was
    since = events[:1]
    if not facts[0].everything:
        since = [frame for frame in facts if frame.number >= events[0].number]
    return _all_contents([only_loose(frame) for frame in since], "", place)


def _left_at_pickup(
    facts: Sequence[FrameFacts], _preposition: str, place: str, item: str
) -> list[str]:
    events = events_of(facts, "PickupObject", item)
    if len(events) != 1:
        return []  # nothing shows when that was, or it was not once
    since = [frame for frame in facts if facts[0].everything or frame.number >= events[0].number]
    return _left_at([only_loose(frame) for frame in since], "PickupObject", place, item)


def _left_at(facts: Sequence[FrameFacts], action: str, place: str, item: str) -> list[str]:
    """Return what is in the receptacle in which an object was until an action on it."""
    if not facts[0].everything:
        return _all_contents(facts, "", place)
    for previous, event in pairwise(facts):
        if event.action == action and event.target is not None and target_is(event, item):
            holder = whole_id(holder_of(previous, event.target))
            objects = event.objects
            inside = [key for key in objects if whole_id(holder_of(event, key)) == holder]
            return sorted(plain_name(objects[key].type) for key in inside)
    return []


def _all_contents(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    """Return what is in a receptacle in any of the frames."""
    names: dict[str, str] = {}
    for frame in facts:
        names |= _names_inside(frame, place)
    return sorted(names.values())


def _names_inside(frame: FrameFacts, place: str) -> dict[str, str]:
    return {key: plain_name(frame.objects[key].type) for key in ids_inside(frame, place)}


def _is_in(facts: Sequence[FrameFacts], item: str, _preposition: str, place: str) -> list[str]:
    places = _now(facts, item)
    return ["yes" if places[0] == named_type(place) else "no"] if places else []


def _last_inside(facts: Sequence[FrameFacts], place: str) -> dict[str, str]:
    """Return what is in a receptacle in the end, by id, each at the last frame that shows it."""
    if facts[-1].everything:
        return _names_inside(facts[-1], place)
    names: dict[str, str] = {}
    for frame in facts:
        inside = ids_inside(frame, place)
        for key, state in frame.objects.items():
            if key in inside:
                names[key] = plain_name(state.type)
            elif place_of(frame, key) is not None:
                names.pop(key, None)
    return names


def _what_now(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    return sorted(_last_inside(facts, place).values())


def _how_many(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    inside = _last_inside(facts, place)
    return [str(len(inside))] if inside else []


def _moves(facts: Sequence[FrameFacts], words: str) -> list[str]:
    """Return how often it was put down; the whole log must have as many pick-ups."""
    count = len(events_of(facts, "PutObject", words))
    paired = not facts[0].everything or count == len(events_of(facts, "PickupObject", words)) > 1
    return [str(count)] if count and paired else []


def _openings(facts: Sequence[FrameFacts], words: str) -> list[str]:
    count = len(events_of(facts, "OpenObject", words))
    return [str(count)] if count else []


def _puts(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    count = len(_puts_at(facts, place))
    return [str(count)] if count else []


def _n_picked_up(facts: Sequence[FrameFacts]) -> list[str]:
    count = len({frame.target for frame in events_of(facts, "PickupObject")})
    return [str(count)] if count else []


_SOLVERS: tuple[tuple[str, Callable[..., list[str]]], ...] = (
    (r"Is there any (.+) in this room\?", _presence),
    (r"Have you seen (.+)\?", _seen),
    (r"Was the (.+) open\?", _ever_open),
    (r"Where was the (.+) before you put it to the (.+)\?", _before_put),
    (r"Where did you move the (.+) from the (.+)\?", _moved_from),
    (r"Where is the (.+) now\?", _now),
    (r"What did you slice\?", _sliced_types),
    (r"What objects were (in|on) the (.+) when you slice the (.+)\?", _at_slicing),
    (r"What objects were (in|on) the ((?:(?! when you ).)+)\?", _all_contents),
    (r"What object did you put (in|on) the (.+)\?", _put_object),
    (r"Is the (.+) (in|on) the (.+)\?", _is_in),
    (r"What objects are (in|on) the (.+)\?", _what_now),
    (r"How many objects were (in|on) the (.+)\?", _how_many),
    (r"How many times did you move the (.+)\?", _moves),
    # our further forms
    (r"Where was the (.+) before you (first )?picked it up\?", _before),
    (r"Where did you move the (.+) to\?", _moved_to),
    (r"In which places was the (.+), from first to last\?", _journey),
    (r"What did you put (in|on) the (.+)\?", _put_into),
    (r"What did you put down\?", _put_down),
    (r"Where did you put things\?", _put_places),
    (r"What did you open\?", _opened_types),
    (r"Is the (.+) open now\?", _open_now),
    (r"Was the (.+) open when you (picked up|sliced|turned on) the (.+)\?", _open_then),
    (r"Was the (.+) open when you put the (.+) (in|on) the (.+)\?", _open_at_put),
    (
        r"Which things that can be picked up were directly (in|on) the (.+) when you first opened "
        r"it\?",
        _at_opening,
    ),
    (
        r"Which other things that can be picked up were directly (in|on) the (.+)"
        r" when you picked up the (.+) from it\?",
        _left_at_pickup,
    ),
    (r"How many times did you open (?:the|an?) (.+)\?", _openings),
    (r"How many times did you put something (in|on) the (.+)\?", _puts),
    (r"How many different objects did you pick up\?", _n_picked_up),
)
