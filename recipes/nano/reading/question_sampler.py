"""Random questions to learn reading from: on single frames, on clue frames, behind memories, whole.

Most are about homes told otherwise, so that only the frames can answer. Both questions of a pair
of twins are in one step, with the same frames by number and the same names: what differs between
the two worlds is then all that there is to learn from them.
"""

import random
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question
from infthor_eval.household.wording import (
    answer_of,
    canonical_type,
    in_or_on,
    noun,
    with_article,
    with_the,
)
from recipes.nano.reading.asking import Asker, ReadingSequence
from recipes.nano.reading.episodes import Episode, RecordedQuestion, World
from recipes.nano.reading.events import Event, events_in
from recipes.nano.reading.homes import Home, Homes
from recipes.nano.reading.renaming import Vocabulary
from recipes.nano.seeing.units import Units
from recipes.nano.seen_objects import SeenFrame
from recipes.nano.settings import ReadingSettings
from recipes.nano.synthetic_questions import AskedText, Kind, SyntheticQuestions

_MOST_TOKENS = 2500  # of a sequence
# Kinds of questions that few frames are good for, and how often frames are sought for each.
_SOUGHT = {Kind.OPENNESS: 3, Kind.WHETHER_THERE: 2, Kind.CONTENTS: 2}
_TRIES = 8  # choices of frames for such a kind
_MOST_FILLED_FRAMES = 12  # on which synthetic questions are added to recorded ones
_SLICED = "slice"  # slices are no types of their own, so that they cannot be renamed
_IN_ANY_ORDER = ("objects", "things that")  # marks of questions whose answers have no order
_MOST_IDLE = 3  # pairs of frames without an event among those with one


class QuestionSampler:
    """Draws questions.

    Args:
        asker: encodes them.
        episodes: recorded episodes, at least one.
        seen: what their frames show.
        vocabulary: types that are renamed.
        units: units of the frames.
        settings: which questions a step has.
    """

    def __init__(
        self,
        asker: Asker,
        episodes: Sequence[Episode],
        seen: Iterable[SeenFrame],
        vocabulary: Vocabulary,
        units: Units,
        settings: ReadingSettings,
    ) -> None:
        self._asker = asker
        self._episodes = episodes
        self._vocabulary = vocabulary
        self._settings = settings
        frames = [*seen]
        self._homes = Homes(vocabulary, units, frames, episodes, settings)
        self._seen = {one.frame.digest: one for one in frames}
        self._synthetic_questions = SyntheticQuestions(frames)
        self._event_questions = EventQuestions(self._seen)
        self._by_form: dict[str, list[tuple[Episode, RecordedQuestion]]] = defaultdict(list)
        for episode in episodes:
            for question in episode.questions:
                form = vocabulary.form(question.asked[0].text)
                self._by_form[form].append((episode, question))
        self._forms = sorted(self._by_form)
        # Rare forms are as hard as frequent ones.
        self._weights = [len(self._by_form[form]) ** 0.5 for form in self._forms]

    def draw(self, rng: random.Random, progress: float) -> list[ReadingSequence]:
        """Return the questions of a step, with their answers.

        Args:
            rng: source of all random choices.
            progress: share of the steps that is done.
        """
        settings = self._settings
        is_single = progress < settings.single
        grown = min(1.0, max(0.0, progress - settings.single) / settings.ramp)
        drawn: list[ReadingSequence] = []
        while sum(one.tokens.n_tokens for one in drawn) < settings.tokens_per_step:
            home = self._homes.draw(rng)
            found = self._kind(is_single, rng)(rng, grown, home)
            drawn += (one for one in found if one.tokens.n_tokens <= _MOST_TOKENS)
        return drawn

    def _kind(
        self, is_single: bool, rng: random.Random
    ) -> Callable[[random.Random, float, Home], list[ReadingSequence]]:
        settings = self._settings
        share = rng.random()
        if is_single or share < settings.synthetic:
            return self._synthetic
        return self._events if share < settings.synthetic + settings.events else self._recorded

    def _synthetic(self, rng: random.Random, grown: float, home: Home) -> list[ReadingSequence]:
        """Return synthetic questions on some frames of an episode; few frames are the most likely.

        There are none if the frames show nothing to ask for.
        """
        settings = self._settings
        sought = None
        if rng.random() < settings.sought:
            (sought,) = rng.choices([*_SOUGHT], [*_SOUGHT.values()])
        for _ in range(1 if sought is None else _TRIES):
            world = rng.choice(rng.choice(self._episodes).worlds)
            places = self._some_places(len(world.frames), grown, rng)
            asked = self._ask_by_rules(world, places, settings.together, home, rng, sought)
            if asked:
                return [self._sequence(world, places, asked, home)]
        return []

    def _some_places(self, n_frames: int, grown: float, rng: random.Random) -> list[int]:
        """Return the places of some frames of an episode, in a row or anywhere."""
        most = 1 + (self._settings.synthetic_frames - 1) * grown * rng.random() ** 2
        n = min(round(most), n_frames)
        first = rng.randrange(n_frames - n + 1)
        in_a_row = [*range(first, first + n)]
        return in_a_row if rng.random() < 0.5 else sorted(rng.sample(range(n_frames), n))

    def _events(self, rng: random.Random, grown: float, home: Home) -> list[ReadingSequence]:
        """Return questions on a few events in a row.

        There are none if the frames do not show them.
        """
        settings = self._settings
        world = rng.choice(rng.choice(self._episodes).worlds)
        n = 1 + round(rng.random() * (settings.events_in_a_row - 1) * grown)
        places = self._event_questions.draw_places(world, n, rng)
        found = self._event_questions.ask(world, places, settings.together, rng)
        asked = self._all_renamed(found, home, in_any_order=False)
        return [self._sequence(world, places, asked, home)] if asked else []

    def _recorded(self, rng: random.Random, grown: float, home: Home) -> list[ReadingSequence]:
        """Return a question and others that its frames answer; of twins, in both worlds."""
        settings = self._settings
        (form,) = rng.choices(self._forms, self._weights)
        episode, first = rng.choice(self._by_form[form])
        shown = self._shown(rng, grown, episode, first)
        others = [one for one in episode.answerable(shown) if one is not first and one.clues]
        chosen = [first, *rng.sample(others, min(len(others), settings.together - 1))]
        if home.order is not None:
            chosen = [one for one in chosen if not _is_about_slices(one)]
        places = sorted(shown)
        n_more = min(settings.filled, settings.together - len(chosen))
        sequences = []
        for number, world in enumerate(episode.worlds if chosen else ()):
            asked = [self._in_words(one.asked[number], home) for one in chosen]
            if len(places) <= _MOST_FILLED_FRAMES:
                asked += self._ask_by_rules(world, places, n_more, home, rng)
            sequences.append(self._sequence(world, places, asked, home))
        return sequences

    def _shown(
        self, rng: random.Random, grown: float, episode: Episode, question: RecordedQuestion
    ) -> set[int]:
        """Return the places of the frames to show: all, those behind a memory, or the clues."""
        settings = self._settings
        share = rng.random()
        if share < settings.whole * grown:
            return {*range(episode.n_frames)}
        shown = {*question.shown}
        if share < settings.recalled:
            n_others = rng.randint(0, round(settings.recalled_frames * grown))
            shown |= {*rng.sample(range(episode.n_frames), min(n_others, episode.n_frames))}
            shown.add(episode.n_frames - 1)
        return shown

    def _ask_by_rules(
        self,
        world: World,
        places: Sequence[int],
        n: int,
        home: Home,
        rng: random.Random,
        sought: Kind | None = None,
    ) -> list[AskedText]:
        seen = (self._seen[world.frames[at].digest] for at in places)
        shown = [home.objects(objects) for _, objects in seen]
        asked = self._synthetic_questions.ask(shown, n, rng, sought)
        return self._all_renamed(asked, home, in_any_order=True)

    def _all_renamed(
        self, asked: Iterable[AskedText], home: Home, *, in_any_order: bool
    ) -> list[AskedText]:
        """Return questions in the names of a home; one about slices cannot be renamed."""
        return [
            self._renamed(text, answer.split(", "), home, in_any_order=in_any_order)
            for text, answer in asked
            if home.order is None or _SLICED not in text + answer
        ]

    def _in_words(self, question: Question, home: Home) -> AskedText:
        in_any_order = any(mark in question.text for mark in _IN_ANY_ORDER)
        answers = home.answers(question)
        return self._renamed(question.text, answers, home, in_any_order=in_any_order)

    def _renamed(
        self, text: str, answers: Sequence[str], home: Home, *, in_any_order: bool
    ) -> AskedText:
        renaming = home.renaming
        new = [self._vocabulary.rename_answer(answer, renaming) for answer in answers]
        return self._vocabulary.rename(text, renaming), ", ".join(
            sorted(new) if in_any_order else new
        )

    def _sequence(
        self, world: World, places: Sequence[int], asked: Sequence[AskedText], home: Home
    ) -> ReadingSequence:
        frames: list[FrameRef] = [world.frames[at] for at in places]
        events = [
            None if of_frame is None else [(event, home.renaming(name)) for event, name in of_frame]
            for of_frame in events_in(world.happenings, places)
        ]
        return self._asker.ask(frames, home, asked, events)


def _is_about_slices(question: RecordedQuestion) -> bool:
    return any(
        _SLICED in text
        for asked in question.asked
        for text in (asked.text, *map(str, asked.answers))
    )


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
