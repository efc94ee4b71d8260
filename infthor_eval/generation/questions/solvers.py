"""Answers to questions by their text, from glimpses of what happened: the second opinion's own way.

It does not know how a question came about and shares no code with the rules, so that it does not share their faults.
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
    """One moment: its frame, the action that led to it, what is known of the objects, and which types are loose.

    That something of a type can be picked up is known of things, whatever the moment.
    """

    frame: int
    action: str
    target: str | None
    objects: dict[str, ObjectState]
    everything: bool
    loose: frozenset[str]


def frame_facts(steps: Sequence[Step], share: float, frames: Container[int] | None = None) -> list[FrameFacts]:
    """What the log tells: all of it, or what the entries of some frames show.

    Args:
        steps: the log.
        share: of the frame's pixels that an object must fill to be seen.
        frames: the clue frames; None for the whole log.
    """
    found = []
    loose = frozenset(name for step in steps for name in step.object_log.pickupable)
    for step, world in zip(steps, iter_object_states(steps), strict=True):
        there = {key: state for key, state in world.items() if state.exists}
        if frames is not None:
            if step.img_idx not in frames:
                continue
            large = {key for key, seen in (step.seen or {}).items() if seen.pixels >= share * _FRAME_PIXELS}
            there = {key: state for key, state in there.items() if key in large}
        action = (step.action or "").split(" ")[0] if step.success else ""
        found.append(FrameFacts(step.img_idx, action, step.target, there, frames is None, loose))
    return found


def answer(text: str, seen: Sequence[FrameFacts]) -> list[str] | None:
    """Answer a question from glimpses; None where they do not tell."""
    for pattern, solve in _SOLVERS:
        match = re.fullmatch(pattern, text)
        if match is not None and seen:
            found = solve(seen, *match.groups())
            return found if found else None
    return None


def _name(object_type: str) -> str:
    return object_type.lower().replace(" ", "").removesuffix("basin")


def _said(words: str) -> str:
    """The type that words name: "sliced apple" is AppleSliced."""
    words = words.lower()
    if words.startswith("sliced "):
        words = f"{words.removeprefix('sliced ')}sliced"
    return _name(words)


def _is(state: ObjectState, words: str) -> bool:
    return _name(state.type) == _said(words)


def _holder(glimpse: FrameFacts, key: str) -> str | None:
    """What an object is directly in or on: of its parents the one that is in most of the others.

    Found in its own way, not by `household.containment`, on which the rules rely: a second opinion must not share their
    faults.
    """
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
    """Of a part's id ("Sink|x|y|z|SinkBasin") that of the whole."""
    return None if key is None else "|".join(key.split("|")[:4])


def _place(glimpse: FrameFacts, key: str) -> str | None:
    holder = _holder(glimpse, key)
    return None if holder is None else _name(glimpse.objects[holder].type)


def _inside(glimpse: FrameFacts, words: str) -> set[str]:
    """Ids of what is in or on a receptacle of a type."""
    return {key for key in glimpse.objects if _place(glimpse, key) == _said(words)}


def _names(glimpse: FrameFacts, keys: set[str]) -> list[str]:
    return sorted(_name(glimpse.objects[key].type) for key in keys)


def _events(seen: Sequence[FrameFacts], action: str, words: str | None = None) -> list[FrameFacts]:
    """The moments right after an action on an object of a type, of which the moment itself tells."""
    moments = [item for item in seen if item.action == action and _is_told(item)]
    return [item for item in moments if words is None or _target_is(item, words)]


def _is_told(item: FrameFacts) -> bool:
    """Whether what was acted on is among the objects that are known, or what became of it where it was cut."""
    target = item.target or ""
    return target in item.objects or any(key.startswith(f"{target}|") for key in item.objects)


def _target_name(item: FrameFacts) -> str:
    """The type of the object acted on, from its id: the last part for slices and basins."""
    parts = (item.target or "").split("|")
    return _name(re.sub(r"_\d+$", "", parts[-1]) if len(parts) > 4 else parts[0])


def _target_is(item: FrameFacts, words: str) -> bool:
    return _target_name(item) == _said(words)


def _handled(seen: Sequence[FrameFacts], words: str) -> str | None:
    """The object of a type that is acted on, or else the only one there."""
    acted = {item.target for item in seen if item.target in item.objects and _is(item.objects[item.target], words)}
    there = {key for item in seen for key, state in item.objects.items() if _is(state, words)}
    chosen = acted or there
    return next(iter(chosen)) if len(chosen) == 1 else None


def _track(seen: Sequence[FrameFacts], words: str) -> list[tuple[FrameFacts, str]]:
    """Where the handled object of a type is at each moment at which that is known."""
    key = _handled(seen, words)
    if key is None:
        return []
    known = [(item, _place(item, key)) for item in seen if key in item.objects]
    return [(item, place) for item, place in known if place is not None]


def _presence(seen: Sequence[FrameFacts], words: str) -> list[str]:
    words = re.sub(r"^an? ", "", words)
    return ["yes" if any(_is(state, words) for item in seen for state in item.objects.values()) else "no"]


def _before(seen: Sequence[FrameFacts], words: str, first: str | None) -> list[str]:
    picked = [item.frame for item in _events(seen, "PickupObject", words)]
    if len(picked) > 1 and not first:
        return []  # which one is meant?
    places = [place for item, place in _track(seen, words) if not picked or item.frame < picked[0]]
    return places[-1:]


def _before_put(seen: Sequence[FrameFacts], words: str, place: str) -> list[str]:
    """Where it was before the one put into a place, if that was one place only."""
    track = _track(seen, words)
    puts = {item.frame for item in _events(seen, "PutObject", words)}
    there = [item.frame for item, name in track if item.frame in puts and name == _said(place)]
    before = {name for item, name in track if there and item.frame < there[0]}
    return list(before) if len(there) == len(before) == 1 else []


def _moved_from(seen: Sequence[FrameFacts], words: str, place: str) -> list[str]:
    """Where it went from a place, if it left that once and then stayed."""
    places = _journey(seen, words)
    return places[-1:] if len(places) > 1 and places[-2] == _said(place) and places.count(_said(place)) == 1 else []


def _moved_to(seen: Sequence[FrameFacts], words: str) -> list[str]:
    puts = {item.frame for item in _events(seen, "PutObject", words)}
    return [place for item, place in _track(seen, words) if item.frame in puts][-1:]


def _now(seen: Sequence[FrameFacts], words: str) -> list[str]:
    return [place for _, place in _track(seen, words)][-1:]


def _journey(seen: Sequence[FrameFacts], words: str) -> list[str]:
    places = [place for _, place in _track(seen, words)]
    return places[:1] + [place for previous, place in pairwise(places) if place != previous]


def _put_into(seen: Sequence[FrameFacts], _preposition: str, words: str) -> list[str]:
    found: dict[str, str] = {}
    for item in _events(seen, "PutObject"):
        if item.target in item.objects and _place(item, item.target) == _said(words):
            found.setdefault(item.target, _target_name(item))
    return list(found.values())


def _put_object(seen: Sequence[FrameFacts], _preposition: str, words: str) -> list[str]:
    """What is in the hand at one moment and in or on a receptacle at the next."""
    found = []
    for previous, item in pairwise(seen):
        target = item.target or ""
        held = target in previous.objects and previous.objects[target].held
        if item.action == "PutObject" and held and target in item.objects and _place(item, target) == _said(words):
            found.append(_target_name(item))
    return found


def _put_down(seen: Sequence[FrameFacts]) -> list[str]:
    found: dict[str, str] = {}
    for item in _events(seen, "PutObject"):
        if _place(item, item.target or "") is not None:
            found.setdefault(item.target or "", _target_name(item))
    return list(found.values())


def _put_places(seen: Sequence[FrameFacts]) -> list[str]:
    places = (_place(item, item.target or "") for item in _events(seen, "PutObject"))
    return list(dict.fromkeys(place for place in places if place is not None))


def _opened(seen: Sequence[FrameFacts]) -> list[str]:
    return list(dict.fromkeys(_target_name(item) for item in _events(seen, "OpenObject")))


def _open(item: FrameFacts, words: str) -> list[str]:
    states = [state for state in item.objects.values() if _is(state, words) and state.is_open is not None]
    return ["yes" if states[0].is_open else "no"] if len(states) == 1 else []


def _ever_open(seen: Sequence[FrameFacts], words: str) -> list[str]:
    known = {answer for item in seen for answer in _open(item, words)}
    return [max(known)] if known else []  # "yes" is the later word


def _open_now(seen: Sequence[FrameFacts], words: str) -> list[str]:
    known = [found for item in seen if (found := _open(item, words))]
    return known[-1] if known else []


def _open_then(seen: Sequence[FrameFacts], words: str, verb: str, item: str) -> list[str]:
    actions = {"picked up": "PickupObject", "sliced": "SliceObject", "turned on": "ToggleObjectOn"}
    moments = _events(seen, actions[verb], item)
    return _open(moments[0], words) if len(moments) == 1 else []


def _open_at_put(seen: Sequence[FrameFacts], words: str, item: str, _preposition: str, place: str) -> list[str]:
    moments = [
        moment
        for moment in _events(seen, "PutObject", item)
        if moment.target in moment.objects and _place(moment, moment.target) == _said(place)
    ]
    return _open(moments[0], words) if len(moments) == 1 else []


def _sliced(seen: Sequence[FrameFacts]) -> list[str]:
    return [_target_name(item) for item in _events(seen, "SliceObject")]


def _at_slicing(seen: Sequence[FrameFacts], _preposition: str, place: str, item: str) -> list[str]:
    names = _left_at(seen, "SliceObject", place, item)
    return sorted({_said(item) if name == f"{_said(item)}sliced" else name for name in names})


def _always_inside(seen: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    return _listed(seen, place)


def _at_opening(seen: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    moments = _events(seen, "OpenObject", place)[:1] if seen[0].everything else seen
    return _listed([_only_loose(item) for item in moments], place)


def _left_at_pickup(seen: Sequence[FrameFacts], _preposition: str, place: str, item: str) -> list[str]:
    return _left_at([_only_loose(glimpse) for glimpse in seen], "PickupObject", place, item)


def _left_at(seen: Sequence[FrameFacts], action: str, place: str, item: str) -> list[str]:
    """What is in the receptacle in which an object was until an action on it."""
    if not seen[0].everything:
        return _listed(seen, place)
    for previous, moment in pairwise(seen):
        if moment.action == action and moment.target is not None and _target_is(moment, item):
            holder = _whole(_holder(previous, moment.target))
            return _names(moment, {key for key in moment.objects if _whole(_holder(moment, key)) == holder})
    return []


def _only_loose(item: FrameFacts) -> FrameFacts:
    """A moment without the fixtures that stand in or on others; what has no holder stays, as it may be one."""
    kept = {key: state for key, state in item.objects.items() if state.type in item.loose or not state.parents}
    return replace(item, objects=kept)


def _listed(seen: Sequence[FrameFacts], place: str) -> list[str]:
    """What is in a receptacle in all glimpses together."""
    found = {key: _name(item.objects[key].type) for item in seen for key in _inside(item, place)}
    return sorted(found.values())


def _is_in(seen: Sequence[FrameFacts], item: str, _preposition: str, place: str) -> list[str]:
    places = _now(seen, item)
    return ["yes" if places[0] == _said(place) else "no"] if places else []


def _last_inside(seen: Sequence[FrameFacts], place: str) -> dict[str, str]:
    """What is in a receptacle in the end, by id: of each object the last that is known."""
    if seen[-1].everything:
        return {key: _name(seen[-1].objects[key].type) for key in _inside(seen[-1], place)}
    found: dict[str, str] = {}
    for item in seen:
        inside = _inside(item, place)
        for key, state in item.objects.items():
            if key in inside:
                found[key] = _name(state.type)
            elif _place(item, key) is not None:
                found.pop(key, None)
    return found


def _what_now(seen: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    return sorted(_last_inside(seen, place).values())


def _how_many(seen: Sequence[FrameFacts], _preposition: str, place: str) -> list[str]:
    found = _last_inside(seen, place)
    return [str(len(found))] if found else []


def _moves(seen: Sequence[FrameFacts], words: str) -> list[str]:
    """How often it was put down; each time it was picked up before, at least where all is known."""
    count = len(_events(seen, "PutObject", words))
    paired = not seen[0].everything or count == len(_events(seen, "PickupObject", words)) > 1
    return [str(count)] if count and paired else []


def _openings(seen: Sequence[FrameFacts], words: str) -> list[str]:
    count = len(_events(seen, "OpenObject", words))
    return [str(count)] if count else []


def _puts(seen: Sequence[FrameFacts], _preposition: str, words: str) -> list[str]:
    puts = [item for item in _events(seen, "PutObject") if _place(item, item.target or "") == _said(words)]
    return [str(len(puts))] if puts else []


def _picked(seen: Sequence[FrameFacts]) -> list[str]:
    count = len({item.target for item in _events(seen, "PickupObject")})
    return [str(count)] if count else []


_SOLVERS: tuple[tuple[str, Callable[..., list[str]]], ...] = (
    (r"Is there any (.+) in this room\?", _presence),
    (r"Have you seen (.+)\?", _presence),
    (r"Was the (.+) open\?", _ever_open),
    (r"Where was the (.+) before you put it to the (.+)\?", _before_put),
    (r"Where did you move the (.+) from the (.+)\?", _moved_from),
    (r"Where is the (.+) now\?", _now),
    (r"What did you slice\?", _sliced),
    (r"What objects were (in|on) the (.+) when you slice the (.+)\?", _at_slicing),
    (r"What objects were (in|on) the ((?:(?! when you ).)+)\?", _always_inside),
    (r"What object did you put (in|on) the (.+)\?", _put_object),
    (r"Is the (.+) (in|on) the (.+)\?", _is_in),
    (r"What objects are (in|on) the (.+)\?", _what_now),
    (r"How many objects were (?:in|on) the (.+)\?", lambda seen, place: _how_many(seen, "", place)),
    (r"How many times did you move the (.+)\?", _moves),
    # our further forms
    (r"Where was the (.+) before you (first )?picked it up\?", _before),
    (r"Where did you move the (.+) to\?", _moved_to),
    (r"In which places was the (.+), from first to last\?", _journey),
    (r"What did you put (in|on) the (.+)\?", _put_into),
    (r"What did you put down\?", _put_down),
    (r"Where did you put things\?", _put_places),
    (r"What did you open\?", _opened),
    (r"Is the (.+) open now\?", _open_now),
    (r"Was the (.+) open when you (picked up|sliced|turned on) the (.+)\?", _open_then),
    (r"Was the (.+) open when you put the (.+) (in|on) the (.+)\?", _open_at_put),
    (r"Which things that can be picked up were directly (in|on) the (.+) when you first opened it\?", _at_opening),
    (
        r"Which other things that can be picked up were directly (in|on) the (.+)"
        r" when you picked up the (.+) from it\?",
        _left_at_pickup,
    ),
    (r"How many times did you open (?:the|an?) (.+)\?", _openings),
    (r"How many times did you put something (in|on) the (.+)\?", _puts),
    (r"How many different objects did you pick up\?", _picked),
)
