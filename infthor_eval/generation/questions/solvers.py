"""Answering questions by their text, from the facts of frames, for the independent check.

The solvers do not know how a question was generated and share no code with the rules, so they do
not share their errors.
"""

import re
from collections.abc import Callable, Sequence
from itertools import pairwise

from infthor_eval.generation.questions.facts import (
    FactEvent,
    FrameFacts,
    events_of,
    holder_of,
    ids_inside,
    is_of_type,
    named_type,
    only_loose,
    place_of,
    plain_name,
    type_of_id,
    whole_id,
)


def answer(text: str, facts: Sequence[FrameFacts]) -> list[str] | None:
    """Return the answers to a question, or None if the facts are not sufficient."""
    for pattern, solve in _SOLVERS:
        match = re.fullmatch(pattern, text)
        if match is not None and facts:
            return solve(facts, *match.groups()) or None
    return None


def _handled_object(facts: Sequence[FrameFacts], words: str) -> str | None:
    """Return the object of a type that is acted on, or else the only known one."""
    known = {
        key for frame in facts for key, state in frame.objects.items() if is_of_type(state, words)
    }
    acted = {event.target for event in events_of(facts, "PickupObject", words)}
    candidates = acted & known or known
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
    picked = [event.frame.number for event in events_of(facts, "PickupObject", words)]
    if len(picked) > 1 and not first:
        return []  # ambiguous
    places = [
        place for frame, place in _track(facts, words) if not picked or frame.number < picked[0]
    ]
    return places[-1:]


def _before_put(
    facts: Sequence[FrameFacts], words: str, _preposition: str, place: str
) -> list[str]:
    """Return where it was before the only put into a place, if that was only one place."""
    track = _track(facts, words)
    # Clue frames show where it lay first and then; that it was put there is in the question.
    puts = {event.frame.number for event in events_of(facts, "PutObject", words)}
    there = [
        frame.number
        for frame, name in track
        if name == named_type(place) and (frame.number in puts or not frame.everything)
    ]
    before = {name for frame, name in track if there and frame.number < there[0]}
    return list(before) if len(there) == len(before) == 1 else []


def _moved_from(facts: Sequence[FrameFacts], words: str, place: str) -> list[str]:
    """Return where it went from a place, if it left that place once and then stayed."""
    places = _journey(facts, words)
    start = named_type(place)
    return places[-1:] if places[-2:-1] == [start] and places.count(start) == 1 else []


def _moved_to(facts: Sequence[FrameFacts], words: str) -> list[str]:
    puts = {event.frame.number for event in events_of(facts, "PutObject", words)}
    places = [
        place
        for frame, place in _track(facts, words)
        if frame.number in puts or not frame.everything
    ]
    return places[-1:]


def _now(facts: Sequence[FrameFacts], words: str) -> list[str]:
    return [place for _, place in _track(facts, words)][-1:]


def _journey(facts: Sequence[FrameFacts], words: str) -> list[str]:
    places = [place for _, place in _track(facts, words)]
    return places[:1] + [place for previous, place in pairwise(places) if place != previous]


def _puts_at(facts: Sequence[FrameFacts], place: str, words: str | None = None) -> list[FactEvent]:
    """Return the puts (of a type of object) into a type of receptacle."""
    return [
        event
        for event in events_of(facts, "PutObject", words)
        if _place_put(event) == named_type(place)
    ]


def _place_put(event: FactEvent) -> str | None:
    """Return the type of what an object is in or on after a put."""
    return place_of(event.frame, event.target) if event.target in event.frame.objects else None


def _put_into(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    return _types_put(_puts_at(facts, place))


def _put_down(facts: Sequence[FrameFacts]) -> list[str]:
    puts = events_of(facts, "PutObject")
    return _types_put([event for event in puts if _place_put(event) is not None])


def _types_put(events: Sequence[FactEvent]) -> list[str]:
    """Return the type of each object that was put, once an object."""
    return list({event.target: type_of_id(event.target) for event in events}.values())


def _put_places(facts: Sequence[FrameFacts]) -> list[str]:
    places = map(_place_put, events_of(facts, "PutObject"))
    return list(dict.fromkeys(place for place in places if place is not None))


def _opened_types(facts: Sequence[FrameFacts]) -> list[str]:
    opened = (type_of_id(event.target) for event in events_of(facts, "OpenObject"))
    return list(dict.fromkeys(opened))


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
    return _open(events[0].frame, words) if len(events) == 1 else []


def _open_at_put(
    facts: Sequence[FrameFacts], words: str, item: str, _preposition: str, place: str
) -> list[str]:
    events = _puts_at(facts, place, item)
    return _open(events[0].frame, words) if len(events) == 1 else []


def _sliced_types(facts: Sequence[FrameFacts]) -> list[str]:
    sliced = {event.target: type_of_id(event.target) for event in events_of(facts, "SliceObject")}
    return list(sliced.values())


def _at_slicing(facts: Sequence[FrameFacts], _preposition: str, place: str, item: str) -> list[str]:
    names = _left_at(facts, "SliceObject", place, item)
    whole = named_type(item)
    return sorted({whole if name == f"{whole}sliced" else name for name in names})


def _at_opening(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    if facts[0].everything:
        opened = [event.frame for event in events_of(facts, "OpenObject", place)]
        since = opened[:1]
    else:
        opened = [frame for frame in facts if _open(frame, place) == ["yes"]]
        since = [frame for frame in facts if opened and frame.number >= opened[0].number]
    return _all_contents([only_loose(frame) for frame in since], "", place)


def _left_at_pickup(
    facts: Sequence[FrameFacts], _preposition: str, place: str, item: str
) -> list[str]:
    everything = facts[0].everything
    picked = [event.frame.number for event in events_of(facts, "PickupObject", item)]
    if not picked or (everything and len(picked) > 1):
        return []  # nothing shows when that was, or it was not once
    since = [only_loose(frame) for frame in facts if everything or frame.number >= picked[0]]
    return _left_at(since, "PickupObject", place, item)


def _left_at(facts: Sequence[FrameFacts], action: str, place: str, item: str) -> list[str]:
    """Return what is in the receptacle in which an object was until an action on it."""
    if not facts[0].everything:
        return _all_contents(facts, "", place)
    for event in events_of(facts, action, item):
        after = event.frame
        previous = next(frame for frame in facts if frame.number == after.number - 1)
        holder = whole_id(holder_of(previous, event.target))
        inside = [key for key in after.objects if whole_id(holder_of(after, key)) == holder]
        return sorted(plain_name(after.objects[key].type) for key in inside)
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
    if facts[0].everything:
        count = len(events_of(facts, "PutObject", words))
        paired = count == len(events_of(facts, "PickupObject", words)) > 1
    else:  # the hand tells, or by Table 3's rule each clue shows it put down once
        count = len(events_of(facts, "PutObject", words)) or len(_track(facts, words))
        paired = True
    return [str(count)] if count and paired else []


def _openings(facts: Sequence[FrameFacts], words: str) -> list[str]:
    count = len(events_of(facts, "OpenObject", words))
    return [str(count)] if count else []


def _puts(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    count = len(_puts_at(facts, place))
    return [str(count)] if count else []


def _n_picked_up(facts: Sequence[FrameFacts]) -> list[str]:
    count = len({event.target for event in events_of(facts, "PickupObject")})
    return [str(count)] if count else []


def _picked_before(facts: Sequence[FrameFacts], words: str, other: str) -> list[str]:
    """Return whether one thing was picked up before another; frames show what the hand holds."""
    first = [event.frame.number for event in events_of(facts, "PickupObject", words)]
    second = [event.frame.number for event in events_of(facts, "PickupObject", other)]
    if not first or not second or (facts[0].everything and len(first) + len(second) > 2):
        return []
    return ["yes" if first[0] < second[0] else "no"]


_COUNTED_BACK = {"last": 1, "second": 2, "third": 3, "fourth": 4, "fifth": 5}


def _back(
    facts: Sequence[FrameFacts], action: str, ordinal: str, _last: str | None
) -> FactEvent | None:
    """Return the event of a name that is so many from the end."""
    events = events_of(facts, action)
    back = _COUNTED_BACK[ordinal]
    return events[-back] if len(events) >= back else None


def _put_back(facts: Sequence[FrameFacts], *ordinal: str) -> list[str]:
    event = _back(facts, "PutObject", *ordinal)
    return [] if event is None else [type_of_id(event.target)]


def _place_back(facts: Sequence[FrameFacts], *ordinal: str) -> list[str]:
    event = _back(facts, "PutObject", *ordinal)
    place = None if event is None else _place_put(event)
    return [] if place is None else [place]


def _opened_back(facts: Sequence[FrameFacts], *ordinal: str) -> list[str]:
    event = _back(facts, "OpenObject", *ordinal)
    return [] if event is None else [type_of_id(event.target)]


_ORDINAL = r"(last|second|third|fourth|fifth)( to last)?"
_SOLVERS: tuple[tuple[str, Callable[..., list[str]]], ...] = (
    (r"Is there any (.+) in this room\?", _presence),
    (r"Have you seen (.+)\?", _seen),
    (r"Was the (.+) open\?", _ever_open),
    (r"Where was the (.+) before you put it (in|on) the (.+)\?", _before_put),
    (r"Where did you move the (.+) from the (.+)\?", _moved_from),
    (r"Where is the (.+) now\?", _now),
    (r"What did you slice\?", _sliced_types),
    (r"What objects were (in|on) the (.+) when you sliced the (.+)\?", _at_slicing),
    (r"What objects were (in|on) the ((?:(?! when you ).)+)\?", _all_contents),
    (r"What object did you put (in|on) the (.+)\?", _put_into),
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
    (r"Did you pick up the (.+) before the (.+)\?", _picked_before),
    (rf"What did you put down {_ORDINAL}\?", _put_back),
    (rf"Where did you put the object that you put down {_ORDINAL}\?", _place_back),
    (rf"What did you open {_ORDINAL}\?", _opened_back),
)
