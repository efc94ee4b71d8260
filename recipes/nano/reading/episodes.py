"""Recorded episodes to ask about: their frames, their questions, what happened in them."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.samples import find_samples
from infthor_eval.training.encoding import SkippedSequence
from recipes.nano.reading.events import Happening, read_events

_N_WORLDS = 2


@dataclass(frozen=True)
class World:
    """An episode as it went, or as it went in one of the worlds of twins.

    Attributes:
        frames: all frames, in order.
        happenings: what happened, in order.
    """

    frames: tuple[FrameRef, ...]
    happenings: tuple[Happening, ...]


@dataclass(frozen=True)
class RecordedQuestion:
    """A question in its world, or in both worlds of twins.

    Attributes:
        asked: the question in each world.
        shown: places of its clue frames.
    """

    asked: tuple[Question, ...]
    shown: tuple[int, ...]

    @property
    def clues(self) -> frozenset[int]:
        """The clue frames that a reply needs; what is absent has none, as it is so everywhere."""
        return frozenset(self.shown if self.asked[0].has_evidence else ())


@dataclass
class Episode:
    """An episode, or the same episode in both worlds of twins.

    Attributes:
        worlds: the worlds.
        questions: the questions on it.
    """

    worlds: tuple[World, ...]
    questions: list[RecordedQuestion] = field(default_factory=list)

    @property
    def n_frames(self) -> int:
        """Number of frames, the same in both worlds."""
        return len(self.worlds[0].frames)

    def answerable(self, shown: set[int]) -> list[RecordedQuestion]:
        """Return the questions whose clue frames are all among the shown ones."""
        return [question for question in self.questions if question.clues <= shown]


def read_episodes(folders: Sequence[Path]) -> tuple[list[Episode], list[SkippedSequence]]:
    """Read the episodes with questions of replayed sets; of twins, those asked in both worlds.

    Returns:
        The episodes, and the questions that cannot be used.
    """
    episodes: dict[tuple[str, ...], Episode] = {}
    skipped: list[SkippedSequence] = []
    for folder in folders:
        samples = find_samples({"data": str(folder), "context": "clues"})
        skipped += (SkippedSequence(one.question.id, one.reason) for one in samples.skipped)
        by_pair: dict[str, list[QuestionVariant]] = defaultdict(list)
        for sample in samples.samples:
            by_pair[sample.question.pair or sample.question.id].append(sample)
        for worlds in by_pair.values():
            if len(worlds) == (_N_WORLDS if worlds[0].question.pair else 1):
                _add(episodes, samples.data, worlds)
    if not episodes:
        where = ", ".join(map(str, folders))
        raise DataError(f"{where}: no question to learn from; give another set")
    return [*episodes.values()], skipped


def _add(
    episodes: dict[tuple[str, ...], Episode], data: NiehSet, samples: Sequence[QuestionVariant]
) -> None:
    names = tuple(sample.question.traj_id for sample in samples)
    if names not in episodes:
        episodes[names] = Episode(tuple(_world(data, name) for name in names))
    asked = tuple(sample.question for sample in samples)
    episodes[names].questions.append(RecordedQuestion(asked, samples[0].frames))


def _world(data: NiehSet, name: str) -> World:
    return World(tuple(data.frames(name)), tuple(read_events(data.folder(name))))
