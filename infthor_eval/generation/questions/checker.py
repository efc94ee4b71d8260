"""A second opinion on questions: it reads the text and answers from the log, by another way than the rules.

It sees a list of glimpses, and does not know how a question came about. Given the whole log, every glimpse holds the
true state of all objects; given clue frames only, each holds what that frame's entry tells: the action that led to it
and the objects large enough to be seen. A question is sound if both give its gold answer, and its clues are minimal
if no smaller set of them does.
"""

import re
from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass
from itertools import pairwise

from infthor_eval.formats.question import Question
from infthor_eval.formats.step_log import ObjectState, Step, worlds

__all__ = ["Checker", "Glimpse", "Verdict", "answer", "glimpses"]

_FRAME_PIXELS = 300 * 300


@dataclass(frozen=True)
class Glimpse:
    """One moment: its frame, the action that led to it, and what is known of the objects."""

    frame: int
    action: str
    target: str | None
    objects: dict[str, ObjectState]
    everything: bool


@dataclass(frozen=True)
class Verdict:
    """Whether the whole log, the clues alone, and no smaller set of clues give the gold answer."""

    right: bool
    sufficient: bool
    minimal: bool

    @property
    def sound(self) -> bool:
        """Whether all three hold."""
        return self.right and self.sufficient and self.minimal


def glimpses(steps: Sequence[Step], share: float, frames: Container[int] | None = None) -> list[Glimpse]:
    """What the log tells: all of it, or what the entries of some frames show.

    Args:
        steps: the log.
        share: of the frame's pixels that an object must fill to be seen.
        frames: the clue frames; None for the whole log.
    """
    found = []
    for step, world in zip(steps, worlds(steps), strict=True):
        there = {key: state for key, state in world.items() if state.exists}
        if frames is not None:
            if step.img_idx not in frames:
                continue
            large = {key for key, seen in (step.seen or {}).items() if seen.pixels >= share * _FRAME_PIXELS}
            there = {key: state for key, state in there.items() if key in large}
        action = (step.action or "").split(" ")[0] if step.success else ""
        found.append(Glimpse(step.img_idx, action, step.target, there, frames is None))
    return found


def answer(text: str, seen: Sequence[Glimpse]) -> list[str] | None:
    """Answer a question from glimpses; None where they do not tell."""
    for pattern, solve in _SOLVERS:
        match = re.fullmatch(pattern, text)
        if match is not None and seen:
            found = solve(seen, *match.groups())
            return found if found else None
    return None


class Checker:
    """Judges the questions on one trajectory."""

    def __init__(self, steps: Sequence[Step], share: float) -> None:
        """Read the log.

        Args:
            steps: the log.
            share: of the frame's pixels that an object must fill to be seen.
        """
        self._whole = glimpses(steps, share)
        self._single = {item.frame: item for item in glimpses(steps, share, range(len(steps)))}

    def verdict(self, question: Question) -> Verdict:
        """Judge one question. An absence is proven by no frame; its clues count as minimal."""
        gold = sorted(str(item) for item in question.answers)
        clues = question.clues

        def gives(seen: Sequence[Glimpse]) -> bool:
            found = answer(question.text, seen)
            return found is not None and sorted(found) == gold

        shown = [self._single[clue] for clue in clues]
        smaller = [[item for item in shown if item.frame != skipped] for skipped in clues]
        absence = question.text.startswith("Did you see") and gold == ["no"]
        return Verdict(gives(self._whole), gives(shown), absence or not any(gives(rest) for rest in smaller))


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


def _holder(glimpse: Glimpse, key: str) -> str | None:
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


def _place(glimpse: Glimpse, key: str) -> str | None:
    holder = _holder(glimpse, key)
    return None if holder is None else _name(glimpse.objects[holder].type)


def _inside(glimpse: Glimpse, words: str) -> set[str]:
    """Ids of what is in or on a receptacle of a type."""
    return {key for key in glimpse.objects if _place(glimpse, key) == _said(words)}


def _names(glimpse: Glimpse, keys: set[str]) -> list[str]:
    return sorted(_name(glimpse.objects[key].type) for key in keys)


def _events(seen: Sequence[Glimpse], action: str, words: str | None = None) -> list[Glimpse]:
    """The moments right after an action on an object of a type, of which the moment itself tells."""
    moments = [item for item in seen if item.action == action and _is_told(item)]
    return [item for item in moments if words is None or _target_is(item, words)]


def _is_told(item: Glimpse) -> bool:
    """Whether what was acted on is among the objects that are known, or what became of it where it was cut."""
    target = item.target or ""
    return target in item.objects or any(key.startswith(f"{target}|") for key in item.objects)


def _target_name(item: Glimpse) -> str:
    """The type of the object acted on, from its id: the last part for slices and basins."""
    parts = (item.target or "").split("|")
    return _name(re.sub(r"_\d+$", "", parts[-1]) if len(parts) > 4 else parts[0])


def _target_is(item: Glimpse, words: str) -> bool:
    return _target_name(item) == _said(words)


def _handled(seen: Sequence[Glimpse], words: str) -> str | None:
    """The object of a type that is acted on, or else the only one there."""
    acted = {item.target for item in seen if item.target in item.objects and _is(item.objects[item.target], words)}
    there = {key for item in seen for key, state in item.objects.items() if _is(state, words)}
    chosen = acted or there
    return next(iter(chosen)) if len(chosen) == 1 else None


def _track(seen: Sequence[Glimpse], words: str) -> list[tuple[Glimpse, str]]:
    """Where the handled object of a type is at each moment at which that is known."""
    key = _handled(seen, words)
    if key is None:
        return []
    known = [(item, _place(item, key)) for item in seen if key in item.objects]
    return [(item, place) for item, place in known if place is not None]


def _presence(seen: Sequence[Glimpse], words: str) -> list[str]:
    words = re.sub(r"^an? ", "", words)
    return ["yes" if any(_is(state, words) for item in seen for state in item.objects.values()) else "no"]


def _before(seen: Sequence[Glimpse], words: str) -> list[str]:
    picked = [item.frame for item in _events(seen, "PickupObject", words)]
    places = [place for item, place in _track(seen, words) if not picked or item.frame < picked[0]]
    return places[-1:]


def _moved_to(seen: Sequence[Glimpse], words: str) -> list[str]:
    puts = {item.frame for item in _events(seen, "PutObject", words)}
    return [place for item, place in _track(seen, words) if item.frame in puts][-1:]


def _now(seen: Sequence[Glimpse], words: str) -> list[str]:
    return [place for _, place in _track(seen, words)][-1:]


def _journey(seen: Sequence[Glimpse], words: str) -> list[str]:
    places = [place for _, place in _track(seen, words)]
    return places[:1] + [place for previous, place in pairwise(places) if place != previous]


def _put_into(seen: Sequence[Glimpse], _preposition: str, words: str) -> list[str]:
    found: dict[str, str] = {}
    for item in _events(seen, "PutObject"):
        if item.target in item.objects and _place(item, item.target) == _said(words):
            found.setdefault(item.target, _target_name(item))
    return list(found.values())


def _put_down(seen: Sequence[Glimpse]) -> list[str]:
    found: dict[str, str] = {}
    for item in _events(seen, "PutObject"):
        if _place(item, item.target or "") is not None:
            found.setdefault(item.target or "", _target_name(item))
    return list(found.values())


def _put_places(seen: Sequence[Glimpse]) -> list[str]:
    places = (_place(item, item.target or "") for item in _events(seen, "PutObject"))
    return list(dict.fromkeys(place for place in places if place is not None))


def _opened(seen: Sequence[Glimpse]) -> list[str]:
    return list(dict.fromkeys(_target_name(item) for item in _events(seen, "OpenObject")))


def _open(item: Glimpse, words: str) -> list[str]:
    states = [state for state in item.objects.values() if _is(state, words) and state.is_open is not None]
    return ["yes" if states[0].is_open else "no"] if len(states) == 1 else []


def _open_now(seen: Sequence[Glimpse], words: str) -> list[str]:
    known = [found for item in seen if (found := _open(item, words))]
    return known[-1] if known else []


def _open_then(seen: Sequence[Glimpse], words: str, verb: str, item: str) -> list[str]:
    actions = {"picked up": "PickupObject", "sliced": "SliceObject", "turned on": "ToggleObjectOn"}
    moments = _events(seen, actions[verb], item)
    return _open(moments[0], words) if len(moments) == 1 else []


def _open_at_put(seen: Sequence[Glimpse], words: str, item: str, _preposition: str, place: str) -> list[str]:
    moments = [
        moment
        for moment in _events(seen, "PutObject", item)
        if moment.target in moment.objects and _place(moment, moment.target) == _said(place)
    ]
    return _open(moments[0], words) if len(moments) == 1 else []


def _sliced(seen: Sequence[Glimpse]) -> list[str]:
    return [_target_name(item) for item in _events(seen, "SliceObject")]


def _else_at_slicing(seen: Sequence[Glimpse], _preposition: str, place: str, item: str) -> list[str]:
    skipped = {_said(item), f"{_said(item)}sliced"}
    return [name for name in _left_at(seen, "SliceObject", place, item) if name not in skipped]


def _at_opening(seen: Sequence[Glimpse], _preposition: str, place: str) -> list[str]:
    return _listed(_events(seen, "OpenObject", place)[:1] if seen[0].everything else seen, place)


def _left_at_pickup(seen: Sequence[Glimpse], _preposition: str, place: str, item: str) -> list[str]:
    return _left_at(seen, "PickupObject", place, item)


def _left_at(seen: Sequence[Glimpse], action: str, place: str, item: str) -> list[str]:
    """What is in the receptacle in which an object was until an action on it."""
    if not seen[0].everything:
        return _listed(seen, place)
    for previous, moment in pairwise(seen):
        if moment.action == action and moment.target is not None and _target_is(moment, item):
            holder = _whole(_holder(previous, moment.target))
            return _names(moment, {key for key in moment.objects if _whole(_holder(moment, key)) == holder})
    return []


def _listed(seen: Sequence[Glimpse], place: str) -> list[str]:
    """What is in a receptacle in all glimpses together."""
    found = {key: _name(item.objects[key].type) for item in seen for key in _inside(item, place)}
    return sorted(found.values())


def _is_in(seen: Sequence[Glimpse], item: str, _preposition: str, place: str) -> list[str]:
    places = _now(seen, item)
    return ["yes" if places[0] == _said(place) else "no"] if places else []


def _last_inside(seen: Sequence[Glimpse], place: str) -> dict[str, str]:
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


def _what_now(seen: Sequence[Glimpse], _preposition: str, place: str) -> list[str]:
    return sorted(_last_inside(seen, place).values())


def _how_many(seen: Sequence[Glimpse], _preposition: str, place: str) -> list[str]:
    found = _last_inside(seen, place)
    return [str(len(found))] if found else []


def _moves(seen: Sequence[Glimpse], words: str) -> list[str]:
    count = len(_events(seen, "PutObject", words))
    return [str(count)] if count else []


def _openings(seen: Sequence[Glimpse], words: str) -> list[str]:
    count = len(_events(seen, "OpenObject", words))
    return [str(count)] if count else []


def _puts(seen: Sequence[Glimpse], _preposition: str, words: str) -> list[str]:
    puts = [item for item in _events(seen, "PutObject") if _place(item, item.target or "") == _said(words)]
    return [str(len(puts))] if puts else []


def _picked(seen: Sequence[Glimpse]) -> list[str]:
    count = len({item.target for item in _events(seen, "PickupObject")})
    return [str(count)] if count else []


_SOLVERS: tuple[tuple[str, Callable[..., list[str]]], ...] = (
    (r"Did you see (.+)\?", _presence),
    (r"Where was the (.+) before you (?:first )?picked it up\?", _before),
    (r"Where did you move the (.+) to\?", _moved_to),
    (r"Where is the (.+) now\?", _now),
    (r"In which places was the (.+), from first to last\?", _journey),
    (r"What did you put (in|on) the (.+)\?", _put_into),
    (r"What did you put down\?", _put_down),
    (r"Where did you put things\?", _put_places),
    (r"What did you open\?", _opened),
    (r"Is the (.+) open now\?", _open_now),
    (r"Was the (.+) open when you (picked up|sliced|turned on) the (.+)\?", _open_then),
    (r"Was the (.+) open when you put the (.+) (in|on) the (.+)\?", _open_at_put),
    (r"What did you slice\?", _sliced),
    (r"What else was (in|on) the (.+) when you sliced the (.+)\?", _else_at_slicing),
    (r"What was (in|on) the (.+) when you first opened it\?", _at_opening),
    (r"What else was (in|on) the (.+) when you picked up the (.+) from it\?", _left_at_pickup),
    (r"Is the (.+) (in|on) the (.+) now\?", _is_in),
    (r"What is (in|on) the (.+) now\?", _what_now),
    (r"How many objects are (?:in|on) the (.+) now\?", lambda seen, place: _how_many(seen, "", place)),
    (r"How many times did you open (?:the|an?) (.+)\?", _openings),
    (r"How many times did you put something (in|on) the (.+)\?", _puts),
    (r"How many different objects did you pick up\?", _picked),
    (r"How many times did you pick up the (.+) and put it down again\?", _moves),
)
