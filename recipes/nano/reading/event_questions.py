"""Questions by rules on a few events in a row, with answers: what was put where, and how often.

A recorded question of how often something was done has the frames of a whole episode as its clues,
and a reader that cannot count to two learns nothing from it. One event is two frames, and two
events in a row are as short a count as there is.
"""

import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from infthor_eval.household.wording import (
    answer_of,
    canonical_type,
    in_or_on,
    noun,
    with_article,
    with_the,
)
from recipes.nano.reading.episodes import World
from recipes.nano.reading.events import Event
from recipes.nano.seen_objects import SeenFrame
from recipes.nano.synthetic_questions import AskedText

_MOST_IDLE = 3  # pairs of frames without an event among those with one


@dataclass(frozen=True)
class _Change:
    """What an action did, between the frame before `place` and that one.

    Attributes:
        place: place of the first frame after it.
        event: PUT, PICKED_UP or OPENED.
        type: type of the thing.
        where: type of the receptacle that it was put into or picked up from, or None.
    """

    place: int
    event: Event
    type: str
    where: str | None


class EventQuestions:
    """Chooses a few events in a row, and asks about them.

    Args:
        seen: what all frames show, by the digests of their files.
    """

    def __init__(self, seen: Mapping[str, SeenFrame]) -> None:
        self._seen = seen

    def draw_places(self, world: World, n: int, rng: random.Random) -> list[int]:
        """Return the places of the frames before and after up to `n` events in a row, and of some
        between which nothing happens; none if the frames do not show the events."""
        changes = _changes(world)
        places = sorted({one.place for one in changes})
        first = rng.randrange(max(1, len(places) - n + 1))
        chosen = places[first : first + n]
        if not chosen or not all(self._shows(world, one) for one in changes if one.place in chosen):
            return []
        busy = {one.place for one in world.happenings}
        idle = [at for at in range(chosen[0] + 1, chosen[-1]) if at not in busy]
        chosen += rng.sample(idle, min(len(idle), rng.randint(0, _MOST_IDLE)))
        return sorted({at for place in chosen for at in (place - 1, place)})

    def ask(
        self, world: World, places: Sequence[int], n: int, rng: random.Random
    ) -> list[AskedText]:
        """Return up to `n` distinct questions on what frames show to happen, in random order.

        Args:
            world: the world of the frames.
            places: places of the frames, by `draw_places`.
            n: most questions.
            rng: source of all random choices.
        """
        shown = {*places}
        changes = [one for one in _changes(world) if {one.place - 1, one.place} <= shown]
        kinds = (_puts, _pickups, _openings)
        asked = dict.fromkeys(one for kind in kinds for one in kind(changes, rng))
        return rng.sample([*asked], min(n, len(asked)))

    def _shows(self, world: World, change: _Change) -> bool:
        before, after = (
            {canonical_type(one.type) for one in self._seen[world.frames[at].digest].objects}
            for at in (change.place - 1, change.place)
        )
        return change.type in before and change.type in after


def _changes(world: World) -> list[_Change]:
    changes: list[_Change] = []
    for at, one in enumerate(world.happenings):
        if one.place < 1 or one.event not in (Event.PUT, Event.PICKED_UP, Event.OPENED):
            continue
        following = world.happenings[at + 1 : at + 2]
        is_about_it = following and following[0].event == one.event + 1
        where = following[0].type if is_about_it and one.event != Event.OPENED else None
        changes.append(_Change(one.place, one.event, one.type, where))
    return changes


def _of(changes: Sequence[_Change], event: Event) -> list[_Change]:
    return [one for one in changes if one.event == event]


def _listed(types: Sequence[str]) -> str:
    """Return an answer that lists types once each, as they come."""
    return ", ".join(dict.fromkeys(map(answer_of, types)))


def _puts(changes: Sequence[_Change], _: random.Random) -> Iterator[AskedText]:
    puts = [one for one in _of(changes, Event.PUT) if one.where is not None]
    for place in dict.fromkeys(one.where for one in puts if one.where):
        things = [one.type for one in puts if one.where == place]
        yield f"How many times did you put something {in_or_on(place)}?", str(len(things))
        form = "What did you put {}?" if len(things) > 1 else "What object did you put {}?"
        yield form.format(in_or_on(place)), _listed(things)
    for thing in dict.fromkeys(one.type for one in puts):
        places = [one.where for one in puts if one.type == thing and one.where]
        yield f"How many times did you move {with_the(thing)}?", str(len(places))
        yield f"Where did you move {with_the(thing)} to?", answer_of(places[-1])
    if puts:
        yield "What did you put down?", _listed([one.type for one in puts])
        yield "Where did you put things?", _listed([one.where for one in puts if one.where])


def _pickups(changes: Sequence[_Change], rng: random.Random) -> Iterator[AskedText]:
    pickups = _of(changes, Event.PICKED_UP)
    things = [*dict.fromkeys(one.type for one in pickups)]
    if things:
        yield "What did you pick up first?", answer_of(things[0])
        yield "How many different objects did you pick up?", str(len(things))
    for one in pickups:
        is_only_one = [other.type for other in pickups].count(one.type) == 1
        if is_only_one and one.where is not None:
            yield f"Where was {with_the(one.type)} before you picked it up?", answer_of(one.where)
    if len(things) > 1:
        first, second = rng.sample(range(len(things)), 2)
        text = f"Did you pick up {with_the(things[first])} before {with_the(things[second])}?"
        yield text, "yes" if first < second else "no"


def _openings(changes: Sequence[_Change], rng: random.Random) -> Iterator[AskedText]:
    opened = [one.type for one in _of(changes, Event.OPENED)]
    for name in dict.fromkeys(opened):
        named = rng.choice((with_the(name), with_article(noun(name))))
        yield f"How many times did you open {named}?", str(opened.count(name))
    if opened:
        yield "What did you open?", _listed(opened)
