"""Random questions to learn reading from: on single frames, on clue frames, behind memories, whole.

Most are about homes told otherwise, so that only the frames can answer. Both questions of a pair
of twins are in one step, with the same frames by number and the same names: what differs between
the two worlds is then all that there is to learn from them.
"""

import random
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question
from recipes.nano.reading.asking import Asker, ReadingSequence
from recipes.nano.reading.episodes import Episode, RecordedQuestion, World
from recipes.nano.reading.event_questions import EventQuestions
from recipes.nano.reading.events import events_in
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
