"""Answering questions by their text, from the facts of frames, for the independent check.

The solvers do not know how a question was generated and share no code with the rules, so they do
not share their errors.
"""

import re
from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from infthor_eval.formats.step_log import ObjectState, Step, iter_object_states

__all__ = ["FrameFacts", "answer", "frame_facts"]

_FRAME_PIXELS = 300 * 300


@dataclass(frozen=True)
class FrameFacts:
    """What is known at one frame.

    Attributes:
        frame: number of the frame.
        action: name of the successful action before it, or empty.
        target: id of the object acted on.
        objects: states of the known objects by id.
        in_frame: ids of all objects in the frame, however small.
        everything: True if `objects` has all objects, False if only those in the frame.
        loose: types that can be picked up, which is general knowledge and not restricted to the
            frame.
    """

    frame: int
    action: str
    target: str | None
    objects: dict[str, ObjectState]
    in_frame: frozenset[str]
    everything: bool
    loose: frozenset[str]


def frame_facts(
    steps: Sequence[Step], share: float, frames: Container[int] | None = None
) -> list[FrameFacts]:
    """Return the facts of the log, or what clue frames show: objects of this share of pixels."""
    facts = []
    loose = frozenset(name for step in steps for name in step.object_log.pickupable)
    for step, states in zip(steps, iter_object_states(steps), strict=True):
        objects = {key: state for key, state in states.items() if state.exists}
        if frames is not None:
            if step.img_idx not in frames:
                continue
            large = {
                key
                for key, seen in (step.seen or {}).items()
                if seen.pixels >= share * _FRAME_PIXELS
            }
            objects = {key: state for key, state in objects.items() if key in large}
        action = (step.action or "").split(" ")[0] if step.success else ""
        facts.append(
            FrameFacts(
                step.img_idx,
                action,
                step.target,
                objects,
                frozenset(step.seen or {}),
                frames is None,
                loose,
            )
        )
    return facts


def answer(text: str, facts: Sequence[FrameFacts]) -> list[str] | None:
    """Return the answers to a question, or None if the facts are not sufficient."""
    for pattern, solve in _SOLVERS:
        match = re.fullmatch(pattern, text)
        if match is not None and facts:
            return solve(facts, *match.groups()) or None
    return None


def _name(object_type: str) -> str:
    return object_type.lower().replace(" ", "").removesuffix("basin")


def _type_name(words: str) -> str:
    """Return the type for some words: "sliced apple" is AppleSliced."""
    words = words.lower()
    if words.startswith("sliced "):
        words = f"{words.removeprefix('sliced ')}sliced"
    return _name(words)


def _is(state: ObjectState, words: str) -> bool:
    return _name(state.type) == _type_name(words)


def _holder(glimpse: FrameFacts, key: str) -> str | None:
    """Return what an object is directly in: the parent that is in most of the others."""
    # Not by `household.containment`, which the rules use: an independent check must not share its
    # errors.
    state = glimpse.objects[key]
    parents = [parent for parent in state.parents if parent in glimpse.objects]
    parents = [parent for parent in parents if glimpse.objects[parent].type != "Floor"]
    if state.held or not parents:
        return None

    def depth(parent: str) -> tuple[int, int]:
        item = glimpse.objects[parent]
        return sum(other in item.parents for other in parents), item.type.endswith("Basin")

    return max(parents, key=depth)


def _whole(key: str | None) -> str | None:
    """Return the id of the whole for that of a part ("Sink|x|y|z|SinkBasin")."""
    return None if key is None else "|".join(key.split("|")[:4])


def _place(glimpse: FrameFacts, key: str) -> str | None:
    holder = _holder(glimpse, key)
    return None if holder is None else _name(glimpse.objects[holder].type)


def _inside(glimpse: FrameFacts, words: str) -> set[str]:
    """Return the ids of what is in or on a receptacle of a type."""
    return {key for key in glimpse.objects if _place(glimpse, key) == _type_name(words)}


def _events(facts: Sequence[FrameFacts], action: str, words: str | None = None) -> list[FrameFacts]:
    """Return the facts right after an action on an object of a type, if they include the object."""
    events = [item for item in facts if item.action == action and _is_target_known(item)]
    return [item for item in events if words is None or _target_is(item, words)]


def _is_target_known(item: FrameFacts) -> bool:
    """Return True if the object acted on, or a slice of it, is among the known objects."""
    target = item.target or ""
    return target in item.objects or any(key.startswith(f"{target}|") for key in item.objects)


def _target_name(item: FrameFacts) -> str:
    """Return the type of the object acted on, from its id: its last part for slices and basins."""
    parts = (item.target or "").split("|")
    return _name(re.sub(r"_\d+$", "", parts[-1]) if len(parts) > 4 else parts[0])


def _target_is(item: FrameFacts, words: str) -> bool:
    return _target_name(item) == _type_name(words)


def _handled_object(facts: Sequence[FrameFacts], words: str) -> str | None:
    """Return the object of a type that is acted on, or else the only known one."""
    acted = {
        item.target
        for item in facts
        if item.target in item.objects and _is(item.objects[item.target], words)
    }
    known = {key for item in facts for key, state in item.objects.items() if _is(state, words)}
    candidates = acted or known
    return next(iter(candidates)) if len(candidates) == 1 else None


def _track(facts: Sequence[FrameFacts], words: str) -> list[tuple[FrameFacts, str]]:
    """Return where the handled object of a type is, at each frame at which that is known."""
    key = _handled_object(facts, words)
    if key is None:
        return []
    known = [(item, _place(item, key)) for item in facts if key in item.objects]
    return [(item, place) for item, place in known if place is not None]


def _presence(facts: Sequence[FrameFacts], words: str) -> list[str]:
    return [
        "yes"
        if any(_is(state, words) for item in facts for state in item.objects.values())
        else "no"
    ]


def _seen(facts: Sequence[FrameFacts], words: str) -> list[str]:
    words = re.sub(r"^an? ", "", words)
    shown = (item.objects[key] for item in facts for key in item.in_frame & item.objects.keys())
    return ["yes" if any(_is(state, words) for state in shown) else "no"]


def _before(facts: Sequence[FrameFacts], words: str, first: str | None) -> list[str]:
    picked = [item.frame for item in _events(facts, "PickupObject", words)]
    if len(picked) > 1 and not first:
        return []  # ambiguous
    places = [place for item, place in _track(facts, words) if not picked or item.frame < picked[0]]
    return places[-1:]


def _before_put(facts: Sequence[FrameFacts], words: str, place: str) -> list[str]:
    """Return where it was before the only put into a place, if that was only one place."""
    track = _track(facts, words)
    puts = {item.frame for item in _events(facts, "PutObject", words)}
    there = [item.frame for item, name in track if item.frame in puts and name == _type_name(place)]
    before = {name for item, name in track if there and item.frame < there[0]}
    return list(before) if len(there) == len(before) == 1 else []


def _moved_from(facts: Sequence[FrameFacts], words: str, place: str) -> list[str]:
    """Return where it went from a place, if it left that place once and then stayed."""
    places = _journey(facts, words)
    return (
        places[-1:]
        if places[-2:-1] == [_type_name(place)] and places.count(_type_name(place)) == 1
        else []
    )


def _moved_to(facts: Sequence[FrameFacts], words: str) -> list[str]:
    puts = {item.frame for item in _events(facts, "PutObject", words)}
    return [place for item, place in _track(facts, words) if item.frame in puts][-1:]


def _now(facts: Sequence[FrameFacts], words: str) -> list[str]:
    return [place for _, place in _track(facts, words)][-1:]


def _journey(facts: Sequence[FrameFacts], words: str) -> list[str]:
    places = [place for _, place in _track(facts, words)]
    return places[:1] + [place for previous, place in pairwise(places) if place != previous]


def _puts_at(facts: Sequence[FrameFacts], place: str, words: str | None = None) -> list[FrameFacts]:
    """Return the facts right after puts (of a type of object) into a type of receptacle."""
    events = [item for item in _events(facts, "PutObject", words) if item.target in item.objects]
    return [item for item in events if _place(item, item.target or "") == _type_name(place)]


def _put_into(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    return list({item.target: _target_name(item) for item in _puts_at(facts, place)}.values())


def _put_object(facts: Sequence[FrameFacts], _preposition: str, words: str) -> list[str]:
    """Return what is in the hand at one frame and in or on a receptacle at the next."""
    names = []
    for previous, item in pairwise(facts):
        target = item.target or ""
        held = target in previous.objects and previous.objects[target].held
        if (
            item.action == "PutObject"
            and held
            and target in item.objects
            and _place(item, target) == _type_name(words)
        ):
            names.append(_target_name(item))
    return names


def _put_down(facts: Sequence[FrameFacts]) -> list[str]:
    puts = [
        item for item in _events(facts, "PutObject") if _place(item, item.target or "") is not None
    ]
    return list({item.target: _target_name(item) for item in puts}.values())


def _put_places(facts: Sequence[FrameFacts]) -> list[str]:
    places = (_place(item, item.target or "") for item in _events(facts, "PutObject"))
    return list(dict.fromkeys(place for place in places if place is not None))


def _opened_types(facts: Sequence[FrameFacts]) -> list[str]:
    return list(dict.fromkeys(_target_name(item) for item in _events(facts, "OpenObject")))


def _open(item: FrameFacts, words: str) -> list[str]:
    states = [
        state for state in item.objects.values() if _is(state, words) and state.is_open is not None
    ]
    return ["yes" if states[0].is_open else "no"] if len(states) == 1 else []


def _ever_open(facts: Sequence[FrameFacts], words: str) -> list[str]:
    known = {answer for item in facts for answer in _open(item, words)}
    return [max(known)] if known else []  # "yes" is the later word


def _open_now(facts: Sequence[FrameFacts], words: str) -> list[str]:
    known = [answers for item in facts if (answers := _open(item, words))]
    return known[-1] if known else []


def _open_then(facts: Sequence[FrameFacts], words: str, verb: str, item: str) -> list[str]:
    actions = {"picked up": "PickupObject", "sliced": "SliceObject", "turned on": "ToggleObjectOn"}
    events = _events(facts, actions[verb], item)
    return _open(events[0], words) if len(events) == 1 else []


def _open_at_put(
    facts: Sequence[FrameFacts], words: str, item: str, _preposition: str, place: str
) -> list[str]:
    events = _puts_at(facts, place, item)
    return _open(events[0], words) if len(events) == 1 else []


def _sliced_types(facts: Sequence[FrameFacts]) -> list[str]:
    return [_target_name(item) for item in _events(facts, "SliceObject")]


def _at_slicing(facts: Sequence[FrameFacts], _preposition: str, place: str, item: str) -> list[str]:
    names = _left_at(facts, "SliceObject", place, item)
    return sorted(
        {_type_name(item) if name == f"{_type_name(item)}sliced" else name for name in names}
    )


def _at_opening(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    events = _events(facts, "OpenObject", place)
    if not events:
        return []  # nothing shows when that was
    since = (
        events[:1]
        if facts[0].everything
        else [item for item in facts if item.frame >= events[0].frame]
    )
    return _all_contents([_only_loose(item) for item in since], "", place)


def _left_at_pickup(
    facts: Sequence[FrameFacts], _preposition: str, place: str, item: str
) -> list[str]:
    events = _events(facts, "PickupObject", item)
    if len(events) != 1:
        return []  # nothing shows when that was, or it was not once
    since = [
        glimpse for glimpse in facts if facts[0].everything or glimpse.frame >= events[0].frame
    ]
    return _left_at([_only_loose(glimpse) for glimpse in since], "PickupObject", place, item)


def _left_at(facts: Sequence[FrameFacts], action: str, place: str, item: str) -> list[str]:
    """Return what is in the receptacle in which an object was until an action on it."""
    if not facts[0].everything:
        return _all_contents(facts, "", place)
    for previous, event in pairwise(facts):
        if event.action == action and event.target is not None and _target_is(event, item):
            holder = _whole(_holder(previous, event.target))
            inside = [
                state.type
                for key, state in event.objects.items()
                if _whole(_holder(event, key)) == holder
            ]
            return sorted(map(_name, inside))
    return []


def _only_loose(item: FrameFacts) -> FrameFacts:
    """Return the facts without fixtures in or on others; those without a parent are holders."""
    remaining = {
        key: state
        for key, state in item.objects.items()
        if state.type in item.loose or not state.parents
    }
    return replace(item, objects=remaining)


def _all_contents(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    """Return what is in a receptacle in any of the frames."""
    return sorted(
        {
            key: _name(item.objects[key].type) for item in facts for key in _inside(item, place)
        }.values()
    )


def _is_in(facts: Sequence[FrameFacts], item: str, _preposition: str, place: str) -> list[str]:
    places = _now(facts, item)
    return ["yes" if places[0] == _type_name(place) else "no"] if places else []


def _last_inside(facts: Sequence[FrameFacts], place: str) -> dict[str, str]:
    """Return what is in a receptacle in the end, by id, each at the last frame that shows it."""
    if facts[-1].everything:
        return {key: _name(facts[-1].objects[key].type) for key in _inside(facts[-1], place)}
    names: dict[str, str] = {}
    for item in facts:
        inside = _inside(item, place)
        for key, state in item.objects.items():
            if key in inside:
                names[key] = _name(state.type)
            elif _place(item, key) is not None:
                names.pop(key, None)
    return names


def _what_now(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    return sorted(_last_inside(facts, place).values())


def _how_many(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    inside = _last_inside(facts, place)
    return [str(len(inside))] if inside else []


def _moves(facts: Sequence[FrameFacts], words: str) -> list[str]:
    """Return how often it was put down; the whole log must have as many pick-ups."""
    count = len(_events(facts, "PutObject", words))
    paired = not facts[0].everything or count == len(_events(facts, "PickupObject", words)) > 1
    return [str(count)] if count and paired else []


def _openings(facts: Sequence[FrameFacts], words: str) -> list[str]:
    count = len(_events(facts, "OpenObject", words))
    return [str(count)] if count else []


def _puts(facts: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    count = len(_puts_at(facts, place))
    return [str(count)] if count else []


def _n_picked_up(facts: Sequence[FrameFacts]) -> list[str]:
    count = len({item.target for item in _events(facts, "PickupObject")})
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
