"""Questions by rules from what any frames show, with answers: more than recorded ones ask.

A recorded trajectory has a few dozen questions about what mattered in it. Any choice of its frames
has some more about what they show: what is there, what is not, where it is last seen, what is open,
what the agent holds. They are in the words of the recorded ones.
"""

import random
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from infthor_eval.household.wording import (
    answer_of,
    canonical_type,
    in_or_on,
    noun,
    with_article,
    with_the,
)
from infthor_eval.training.nano.seen_objects import SeenFrame, SeenObject

__all__ = ["AskedText", "SyntheticQuestions"]

_PRESENCE = ("Have you seen {0}?", "Is there any {1} in this room?")
_PLACE = (
    "Where is {} now?",
    "Where was {} before you picked it up?",
    "Where did you move {} to?",
)
_OPEN = ("Is {} open now?", "Was {} open?")
_PER_KIND = 3  # most questions of one kind on some frames
_MOST_LISTED = 3  # most objects of an answer that lists them

AskedText = tuple[str, str]
"""Text of a question, and its answer."""


@dataclass
class _Sight:
    """What some frames of an episode show, in order.

    Attributes:
        present: types with any pixel.
        shown: types near enough to count, in the order of their first frame.
        places: receptacle of each type in the last frame with one object of that type.
        openness: whether each type is open in the last frame with one object of that type that can
            be opened.
        held: types that the agent holds, one after the other.
    """

    present: set[str] = field(default_factory=set)
    shown: dict[str, None] = field(default_factory=dict)
    places: dict[str, str] = field(default_factory=dict)
    openness: dict[str, bool] = field(default_factory=dict)
    held: list[str] = field(default_factory=list)

    def add(self, objects: Sequence[SeenObject]) -> None:
        """Add what a frame shows."""
        by_type: dict[str, list[SeenObject]] = defaultdict(list)
        for one in objects:
            by_type[canonical_type(one.type)].append(one)
        for name, instances in by_type.items():
            self._add_type(name, instances)

    def _add_type(self, name: str, instances: Sequence[SeenObject]) -> None:
        self.present.add(name)
        # Of two objects of one type, a question cannot say which one it means.
        self.places.pop(name, None)
        self.openness.pop(name, None)
        if not any(one.is_shown for one in instances):
            return
        self.shown.setdefault(name)
        if any(one.is_held for one in instances) and self.held[-1:] != [name]:
            self.held.append(name)
        if len(instances) == 1:
            (one,) = instances
            if one.parent is not None:
                self.places[name] = canonical_type(one.parent)
            if one.is_open is not None:
                self.openness[name] = one.is_open


class SyntheticQuestions:
    """Makes questions on frames.

    Args:
        seen: all frames; absent objects are those of frames that share something with the ones that
            a question is about, so that the kind of room does not give away the answer.
    """

    def __init__(self, seen: Sequence[SeenFrame]) -> None:
        self._shown = [
            tuple(dict.fromkeys(canonical_type(one.type) for one in objects if one.is_shown))
            for _, objects in seen
        ]
        self._frames_with: dict[str, list[int]] = defaultdict(list)
        for index, names in enumerate(self._shown):
            for name in names:
                self._frames_with[name].append(index)
        held = {one.type for _, objects in seen for one in objects if one.is_held}
        self._movable = {canonical_type(name) for name in held}

    def ask(self, seen: Sequence[SeenFrame], n: int, rng: random.Random) -> list[AskedText]:
        """Return up to `n` distinct questions on frames, in random order."""
        sight = _Sight()
        for _, objects in seen:
            sight.add(objects)
        kinds = (self._presence, self._absence, self._places, self._openness, self._held)
        asked = dict.fromkeys(one for kind in kinds for one in kind(sight, rng))
        return rng.sample([*asked], min(n, len(asked)))

    def _presence(self, sight: _Sight, rng: random.Random) -> Iterator[AskedText]:
        for name in _some(self._movable_first(sight.shown), rng):
            yield _presence_text(name, rng), "yes"

    def _absence(self, sight: _Sight, rng: random.Random) -> Iterator[AskedText]:
        """Yield questions for objects that similar frames show, and these do not."""
        if not sight.shown:
            return
        for _ in range(_PER_KIND):
            alike = rng.choice(self._frames_with[rng.choice([*sight.shown])])
            absent = [name for name in self._shown[alike] if name not in sight.present]
            if absent:
                yield _presence_text(rng.choice(self._movable_first(absent)), rng), "no"

    def _places(self, sight: _Sight, rng: random.Random) -> Iterator[AskedText]:
        known = [name for name in sight.places if name in self._movable]
        for name in _some(known, rng):
            place = sight.places[name]
            yield rng.choice(_PLACE).format(with_the(name)), answer_of(place)
        for name in _some(known, rng)[:1]:
            place = rng.choice([sight.places[name], rng.choice([*sight.places.values()])])
            text = f"Is {with_the(name)} {in_or_on(place)}?"
            yield text, "yes" if place == sight.places[name] else "no"
        yield from self._contents(sight, rng)

    def _contents(self, sight: _Sight, rng: random.Random) -> Iterator[AskedText]:
        contents: dict[str, list[str]] = defaultdict(list)
        for name, place in sight.places.items():
            if name in self._movable:
                contents[place].append(answer_of(name))
        short = [place for place, names in contents.items() if len(names) <= _MOST_LISTED]
        for place in _some(short, rng)[:1]:
            yield f"What objects were {in_or_on(place)}?", ", ".join(sorted(contents[place]))

    def _openness(self, sight: _Sight, rng: random.Random) -> Iterator[AskedText]:
        for name in _some([*sight.openness], rng):
            text = rng.choice(_OPEN).format(with_the(name))
            yield text, "yes" if sight.openness[name] else "no"

    def _held(self, sight: _Sight, rng: random.Random) -> Iterator[AskedText]:
        if sight.held:
            yield "What did you pick up first?", answer_of(sight.held[0])
            yield "How many different objects did you pick up?", str(len({*sight.held}))

    def _movable_first(self, names: Sequence[str] | dict[str, None]) -> list[str]:
        """Return those that can be picked up, or all if there are none: furniture tells no world
        from another."""
        return [name for name in names if name in self._movable] or [*names]


def _some(names: Sequence[str], rng: random.Random) -> list[str]:
    return rng.sample(names, min(_PER_KIND, len(names)))


def _presence_text(name: str, rng: random.Random) -> str:
    words = noun(name)
    return rng.choice(_PRESENCE).format(with_article(words), words)
