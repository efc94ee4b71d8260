"""Questions by rules from what any frames show, with answers: more than recorded ones ask.

A recorded trajectory has a few dozen questions about what mattered in it. Any choice of its frames
has some more about what they show: what is there, what is not, where it is last seen, what is open,
what the agent holds. They are in the words of the recorded ones.
"""

import random
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

from infthor_eval.household.wording import (
    answer_of,
    canonical_type,
    in_or_on,
    noun,
    with_article,
    with_the,
)
from recipes.nano.seen_objects import SeenFrame, SeenObject

_PRESENCE = ("Have you seen {0}?", "Is there any {1} in this room?")
_OPENNESS = ("Is {} open now?", "Was {} open?")
_PLACE = (
    "Where is {} now?",
    "Where was {} before you picked it up?",
    "Where did you move {} to?",
)
_PER_KIND = 3  # most questions of one kind on some frames
_MOST_LISTED = 4  # most objects of a receptacle that questions list
_OTHERS = "Which other things that can be picked up were directly {} when you picked up {} from it?"

AskedText = tuple[str, str]
"""Text of a question, and its answer."""


class Kind(IntEnum):
    """What a question is about."""

    PRESENCE = 0
    ABSENCE = 1
    PLACE = 2
    WHETHER_THERE = 3
    CONTENTS = 4
    OPENNESS = 5
    HELD = 6


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
        objects = [one for _, inside in seen for one in inside]
        self._movable = {canonical_type(one.type) for one in objects if one.is_held}
        self._holders = {canonical_type(one.parent) for one in objects if one.parent}
        n_open, n_closed = (
            sum(one.is_open is is_open and self._is_fixed(one) for one in objects)
            for is_open in (True, False)
        )
        self._asked_of_closed = min(1.0, n_open / max(1, n_closed))

    def _is_fixed(self, one: SeenObject) -> bool:
        return one.is_shown and canonical_type(one.type) not in self._movable

    def ask(
        self,
        shown: Sequence[Sequence[SeenObject]],
        n: int,
        rng: random.Random,
        sought: Kind | None = None,
    ) -> list[AskedText]:
        """Return up to `n` distinct questions on what frames show, in random order; each kind of
        question is as likely as another.

        Args:
            shown: what each of the frames shows.
            n: most questions.
            rng: source of all random choices.
            sought: kind that comes first; there are no questions if there are none of it.
        """
        sight = _Sight()
        for objects in shown:
            sight.add(objects)
        kinds = {
            Kind.PRESENCE: self._presence,
            Kind.ABSENCE: self._absence,
            Kind.PLACE: self._places,
            Kind.WHETHER_THERE: self._whether_there,
            Kind.CONTENTS: self._contents,
            Kind.OPENNESS: self._openness,
            Kind.HELD: self._held,
        }
        found = [[*kinds[kind](sight, rng)] for kind in Kind]
        drawn = [rng.sample(asked, len(asked)) for asked in found]
        if sought is not None and not drawn[sought]:
            return []
        asked = dict.fromkeys(drawn[sought][:n] if sought is not None else ())
        while len(asked) < n and any(drawn):
            asked.setdefault(rng.choice([one for one in drawn if one]).pop())
        return [*asked]

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
        for name in _some(self._with_places(sight), rng):
            yield rng.choice(_PLACE).format(with_the(name)), answer_of(sight.places[name])

    def _with_places(self, sight: _Sight) -> list[str]:
        return [name for name in sight.places if name in self._movable]

    def _whether_there(self, sight: _Sight, rng: random.Random) -> Iterator[AskedText]:
        """Yield whether something is in a receptacle: in its own, or as often in another one that
        is there."""
        there = {*sight.places.values(), *(name for name in sight.shown if name in self._holders)}
        for name in _some(self._with_places(sight), rng):
            own = sight.places[name]
            others = sorted(there - {own})
            place = rng.choice(others) if others and rng.random() < 0.5 else own
            yield f"Is {with_the(name)} {in_or_on(place)}?", "yes" if place == own else "no"

    def _contents(self, sight: _Sight, rng: random.Random) -> Iterator[AskedText]:
        contents: dict[str, list[str]] = defaultdict(list)
        for name in self._with_places(sight):
            contents[sight.places[name]].append(name)
        short = [place for place, names in contents.items() if len(names) <= _MOST_LISTED]
        for place in _some(short, rng):
            names, where = contents[place], in_or_on(place)
            yield f"What objects {rng.choice(('are', 'were'))} {where}?", _listed(names)
            if len(names) > 1:
                taken = rng.choice(names)
                others = [name for name in names if name != taken]
                yield _OTHERS.format(where, with_the(taken)), _listed(others)

    def _openness(self, sight: _Sight, rng: random.Random) -> Iterator[AskedText]:
        """Yield whether things are open. Fixtures are closed most of the time, and are asked about
        as often when they are open; others are turned in half the homes (`homes.Home`)."""
        asked = [
            name
            for name, is_open in sight.openness.items()
            if is_open or name in self._movable or rng.random() < self._asked_of_closed
        ]
        for name in _some(asked, rng):
            text = rng.choice(_OPENNESS).format(with_the(name))
            yield text, "yes" if sight.openness[name] else "no"

    def _held(self, sight: _Sight, rng: random.Random) -> Iterator[AskedText]:
        if sight.held:
            yield "What did you pick up first?", answer_of(sight.held[0])
            yield "How many different objects did you pick up?", str(len({*sight.held}))

    def _movable_first(self, names: Sequence[str] | dict[str, None]) -> list[str]:
        """Return those that can be picked up, or all if there are none: furniture tells no world
        from another."""
        return [name for name in names if name in self._movable] or [*names]


def _listed(names: Sequence[str]) -> str:
    return ", ".join(sorted(map(answer_of, names)))


def _some(names: Sequence[str], rng: random.Random) -> list[str]:
    return rng.sample(names, min(_PER_KIND, len(names)))


def _presence_text(name: str, rng: random.Random) -> str:
    words = noun(name)
    return rng.choice(_PRESENCE).format(with_article(words), words)
