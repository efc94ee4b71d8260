"""Random questions for the small model: on their clue frames, behind memories, on trajectories.

Questions on the same frames are branches of one sequence. Both questions of a pair of twins are in
one step, with the same frames by number: what differs between the two worlds is then all that there
is to learn from them.
"""

import random
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import CONTEXTS, Sample
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.prompts import question_text
from infthor_eval.nieh.samples import find_samples
from infthor_eval.training.encoding import (
    Encoder,
    SkippedSequence,
    TrainingSequence,
    join_branches,
    within,
)
from infthor_eval.training.nano.frame_dataset import FrameDataset
from infthor_eval.training.nano.settings import QuestionSettings
from infthor_eval.training.nano.synthetic_questions import AskedText, SyntheticQuestions
from model_adapters.hf.prompting.prompt import Frame

__all__ = ["QuestionSampler", "question_intro"]

_N_WORLDS = 2
_Worlds = tuple[Sample, ...]
"""A question in its world, or in both worlds of twins."""


def question_intro() -> str:
    """Return the text that precedes every question, on clue frames as behind a memory."""
    return question_text(CONTEXTS["clues"].intro, Question("", "", (), ())).rstrip()


@dataclass
class _Episode:
    """An episode, or the same episode in both worlds of twins.

    Attributes:
        views: frames of each world.
        questions: its questions.
    """

    views: tuple[tuple[FrameRef, ...], ...]
    questions: list[_Worlds] = field(default_factory=list)

    @property
    def last_view(self) -> int:
        """Place of the last frame."""
        return len(self.views[0]) - 1

    def answerable(self, shown: set[int]) -> list[_Worlds]:
        """Return the questions whose clue frames are all among the shown ones."""
        return [worlds for worlds in self.questions if _clues(worlds[0]) <= shown]


class QuestionSampler:
    """Random training sequences of recorded and synthetic questions.

    Args:
        encoder: builds the sequences.
        folders: folders of replayed sets with questions, and of sets of twins.
        dataset: all frames of the sets.
        settings: which questions a step has.
        limit: most tokens of a question on its clue frames.

    Attributes:
        skipped: questions that could not become a sequence.
    """

    def __init__(
        self,
        encoder: Encoder,
        folders: Sequence[Path],
        dataset: FrameDataset,
        settings: QuestionSettings,
        limit: int,
    ) -> None:
        self._encoder = encoder
        self._dataset = dataset
        self._settings = settings
        self._index_by_digest = dataset.index_by_digest()
        self._synthetic_questions = SyntheticQuestions(dataset.seen)
        self._tails: dict[AskedText, TrainingSequence] = {}
        self.skipped: list[SkippedSequence] = []
        episodes: dict[tuple[str, ...], _Episode] = {}
        for folder in folders:
            self._read(folder, limit, episodes)
        self._episodes = [*episodes.values()]
        by_worlds: dict[int, list[tuple[_Episode, _Worlds]]] = defaultdict(list)
        for episode in self._episodes:
            by_worlds[len(episode.views)] += [(episode, worlds) for worlds in episode.questions]
        self._singles, self._pairs = by_worlds[1], by_worlds[_N_WORLDS]

    def __bool__(self) -> bool:
        """Return True if there is any recorded question."""
        return bool(self._episodes)

    def _read(self, folder: Path, limit: int, episodes: dict[tuple[str, ...], _Episode]) -> None:
        """Read the questions of a set; of twins, those that can be asked in both worlds."""
        samples = find_samples({"data": str(folder), "context": "clues"})
        for skipped in samples.skipped:
            self.skipped.append(SkippedSequence(skipped.question.id, skipped.reason))
        by_pair: dict[str, list[Sample]] = defaultdict(list)
        for sample in samples.samples:
            on_clues = within(self._ask(_frames(samples.data, sample), [_asked(sample)]), limit)
            if isinstance(on_clues, SkippedSequence):
                self.skipped.append(SkippedSequence(sample.question.id, on_clues.reason))
            else:
                by_pair[sample.question.pair or sample.question.id].append(sample)
        for worlds in by_pair.values():
            if len(worlds) == (_N_WORLDS if worlds[0].question.pair else 1):
                names = tuple(sample.question.traj_id for sample in worlds)
                if names not in episodes:
                    episodes[names] = _Episode(tuple(map(samples.data.frames, names)))
                episodes[names].questions.append(tuple(worlds))

    def draw(self, rng: random.Random, progress: float) -> list[TrainingSequence]:
        """Return the questions of a step, with their answers.

        Args:
            rng: source of all random choices.
            progress: share of the stage's steps that is done.
        """
        settings = self._settings
        grown = min(1.0, progress / settings.ramp) if settings.ramp else 1.0
        if rng.random() < settings.whole * grown:
            return self._on_trajectory(rng)
        drawn: list[TrainingSequence] = []
        while sum(len(one.branches) for one in drawn) < settings.per_step:
            is_synthetic = rng.random() < settings.synthetic
            drawn += self._synthetic(rng, grown) if is_synthetic else self._recorded(rng, grown)
        return drawn

    def _synthetic(self, rng: random.Random, grown: float) -> list[TrainingSequence]:
        """Return synthetic questions on some frames of an episode; few frames are the most likely.

        There are none if the frames show nothing to ask for.
        """
        view = rng.choice(rng.choice(self._episodes).views)
        most = 1 + round(rng.random() ** 2 * (self._settings.synthetic_frames - 1) * grown)
        frames = [view[at] for at in sorted(rng.sample(range(len(view)), min(most, len(view))))]
        seen = [self._dataset.seen[self._index_by_digest[frame.digest]] for frame in frames]
        asked = self._synthetic_questions.ask(seen, self._settings.together, rng)
        return [self._ask(frames, asked)] if asked else []

    def _recorded(self, rng: random.Random, grown: float) -> list[TrainingSequence]:
        """Return a question and others that its frames answer; of twins, in both worlds."""
        settings = self._settings
        is_paired = bool(self._pairs) and (not self._singles or rng.random() < settings.paired)
        episode, first = rng.choice(self._pairs if is_paired else self._singles)
        shown = set(first[0].frames)
        if rng.random() < settings.recalled:
            # Frames that do not matter, the same in both worlds, and the last view.
            last = episode.last_view
            n_others = rng.randint(0, round(settings.recalled_frames * grown))
            shown = _clues(first[0]) | {last, *rng.sample(range(last), min(n_others, last))}
        others = [worlds for worlds in episode.answerable(shown) if worlds is not first]
        others = rng.sample(others, min(len(others), settings.together - 1))
        return self._in_all_worlds(episode, sorted(shown), [first, *others])

    def _on_trajectory(self, rng: random.Random) -> list[TrainingSequence]:
        """Return questions on a whole trajectory; of twins, in both worlds."""
        episode = rng.choice(self._episodes)
        n = min(len(episode.questions), self._settings.per_trajectory)
        questions = rng.sample(episode.questions, n)
        return self._in_all_worlds(episode, range(episode.last_view + 1), questions)

    def _in_all_worlds(
        self, episode: _Episode, shown: Iterable[int], questions: Sequence[_Worlds]
    ) -> list[TrainingSequence]:
        """Return a sequence for each world of an episode, on the same frames by number."""
        places = [*shown]
        return [
            self._ask([view[at] for at in places], [*map(_asked, samples)])
            for view, samples in zip(episode.views, zip(*questions, strict=True), strict=True)
        ]

    def _ask(self, frames: Sequence[FrameRef], asked: Sequence[AskedText]) -> TrainingSequence:
        """Return questions on frames as branches of one sequence."""
        tails = [self._tail(one, frames[0]) for one in asked]
        head = self._encoder.pieces([*frames, ""])
        head = head[: _n_with_frames(head)]
        whole = [
            TrainingSequence(
                "question", (*head, *tail.pieces), (False,) * len(head) + tail.has_loss
            )
            for tail in tails
        ]
        return join_branches("questions", whole)

    def _tail(self, asked: AskedText, any_frame: FrameRef) -> TrainingSequence:
        """Return what follows the last frame, which does not depend on the frames."""
        if asked not in self._tails:
            text, answer = asked
            prompt = question_text(CONTEXTS["clues"].intro, Question("", text, (), ()))
            whole = self._encoder.answer("question", [any_frame, prompt], answer)
            n = _n_with_frames(whole.pieces)
            self._tails[asked] = TrainingSequence("question", whole.pieces[n:], whole.has_loss[n:])
        return self._tails[asked]


def _asked(sample: Sample) -> AskedText:
    return sample.question.text, doc_target(sample.question)


def _frames(data: NiehSet, sample: Sample) -> list[FrameRef]:
    view = data.frames(sample.question.traj_id)
    return [view[at] for at in sample.frames]


def _clues(sample: Sample) -> set[int]:
    """Return the places of the clue frames; what is absent has none, and is absent everywhere."""
    return set(sample.frames) if sample.question.has_evidence else set()


def _n_with_frames(pieces: Sequence[object]) -> int:
    """Return the number of pieces up to the last frame."""
    return max(at for at, piece in enumerate(pieces) if isinstance(piece, Frame)) + 1
