"""Homes told otherwise: things are taken for others, and what was closed is open.

What a home is like answers most questions about it, and a model that learns that looks at no
frame. In a home told otherwise only the frames can answer. Things are renamed, and those that
nobody opens or closes, such as laptops, are turned: open where they were closed, and the other way
round. In recorded homes each type of them is always the one or the other.
"""

import random
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from infthor_eval.formats.question import Question
from infthor_eval.household.wording import canonical_type, with_the
from recipes.nano.reading.episodes import Episode
from recipes.nano.reading.events import Event
from recipes.nano.reading.renaming import Renaming, Vocabulary
from recipes.nano.seeing.units import Units
from recipes.nano.seen_objects import SeenFrame, SeenObject
from recipes.nano.settings import ReadingSettings

_OTHERWISE = {"yes": "no", "no": "yes"}


class Home(NamedTuple):
    """A home, as it was recorded or told otherwise.

    Attributes:
        renaming: new types by old ones.
        order: for each type of the units, the index of the type that it is in the frames as they
            were recorded; None if nothing is renamed.
        turned: types that are open where they were closed, and the other way round.
        turned_units: their indices among the units' types.
    """

    renaming: Renaming
    order: tuple[int, ...] | None
    turned: frozenset[str]
    turned_units: tuple[int, ...]

    def objects(self, objects: Sequence[SeenObject]) -> tuple[SeenObject, ...]:
        """Return what a frame shows, with things turned, in their old names."""
        return tuple(
            one._replace(is_open=not one.is_open)
            if one.is_open is not None and canonical_type(one.type) in self.turned
            else one
            for one in objects
        )

    def answers(self, question: Question) -> list[str]:
        """Return the answers to a recorded question, in the old names."""
        answers = [*map(str, question.answers)]
        starts = tuple(
            f"{verb} {with_the(name)} open" for name in self.turned for verb in ("Is", "Was")
        )
        if not question.text.startswith(starts):
            return answers
        return [_OTHERWISE.get(answer, answer) for answer in answers]


class Homes:
    """Draws homes.

    Args:
        vocabulary: types that are renamed.
        units: units of the frames.
        seen: what the frames show.
        episodes: what was done in them.
        settings: in which share of the homes things are renamed, and turned.
    """

    def __init__(
        self,
        vocabulary: Vocabulary,
        units: Units,
        seen: Iterable[SeenFrame],
        episodes: Iterable[Episode],
        settings: ReadingSettings,
    ) -> None:
        self._vocabulary = vocabulary
        self._units = units
        self._settings = settings
        can_be_open = {
            canonical_type(one.type)
            for _, objects in seen
            for one in objects
            if one.is_open is not None and units.index(one.type) >= 0
        }
        opened = {
            one.type
            for episode in episodes
            for world in episode.worlds
            for one in world.happenings
            if one.event in (Event.OPENED, Event.CLOSED)
        }
        self._turned = sorted(can_be_open - opened)

    def draw(self, rng: random.Random) -> Home:
        """Return a random home."""
        renaming, order = Renaming({}), None
        if rng.random() < self._settings.renamed:
            renaming = self._vocabulary.draw(rng)
            order = self._order(renaming)
        turned = [name for name in self._turned if rng.random() < self._settings.turned]
        return Home(renaming, order, frozenset(turned), tuple(map(self._units.index, turned)))

    def _order(self, renaming: Renaming) -> tuple[int, ...]:
        old = {renaming(name): at for at, name in enumerate(self._units.types)}
        return tuple(old[name] for name in self._units.types)
