"""Random questions for the small model: on their clue frames, behind memories, on trajectories.

Both questions of a pair of twins are in one step, with the same frames by number: what differs
between the two worlds is then all that there is to learn from them.
"""

import random
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.household.wording import noun, with_article
from infthor_eval.nieh.contexts import CONTEXTS, MEMORY, Sample
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.prompts import question_text
from infthor_eval.nieh.samples import find_samples
from infthor_eval.training.encoding import (
    Encoder,
    SkippedSequence,
    TrainingSequence,
    join_branches,
)
from infthor_eval.training.nano.frame_dataset import FrameDataset
from infthor_eval.training.nano.settings import QuestionSettings
from infthor_eval.training.question_sequences import question_sequences

__all__ = ["QuestionSampler", "question_intro"]

_LEAST_FRAMES = 20  # frames that have to show a type before synthetic questions ask for it
_PRESENCE = ("Have you seen {0}?", "Is there any {1} in this room?")
_MAX_TRIES = 200
_N_WORLDS = 2


def question_intro() -> str:
    """Return the text that precedes every question on clue frames."""
    return question_text(CONTEXTS["clues"].intro, Question("", "", (), ())).rstrip()


@dataclass(frozen=True)
class _Asked:
    """A question of a set, with the sequence that asks it on its clue frames."""

    data: NiehSet
    sample: Sample
    on_clues: TrainingSequence

    @property
    def traj_id(self) -> str:
        """Its trajectory."""
        return self.sample.question.traj_id

    @property
    def last_view(self) -> int:
        """Place of the last frame of its trajectory."""
        return len(self.data.frames(self.traj_id)) - 1


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
        self.skipped: list[SkippedSequence] = []
        self._singles: list[_Asked] = []
        self._pairs: list[tuple[_Asked, ...]] = []
        for folder in folders:
            self._read(folder, limit)
        self._episodes = self._group_by_episode()
        counts = dict(zip(dataset.types, dataset.visible.sum(0).tolist(), strict=True))
        frequent = {name: count for name, count in counts.items() if count >= _LEAST_FRAMES}
        self._names, self._weights = list(frequent), list(frequent.values())

    def __bool__(self) -> bool:
        """Return True if there is any recorded question."""
        return bool(self._singles or self._pairs)

    def _read(self, folder: Path, limit: int) -> None:
        """Read the questions of a set; of twins, those that can be asked in both worlds."""
        samples = find_samples({"data": str(folder), "context": "clues"})
        encoded = list(question_sequences(self._encoder, samples, limit))
        by_pair: dict[str, list[_Asked]] = defaultdict(list)
        # What the context itself skips comes first.
        for sample, sequence in zip(samples.samples, encoded[len(samples.skipped) :], strict=True):
            if isinstance(sequence, SkippedSequence):
                continue
            asked = _Asked(samples.data, sample, sequence)
            if sample.question.pair:
                by_pair[sample.question.pair].append(asked)
            else:
                self._singles.append(asked)
        self._pairs += [tuple(both) for both in by_pair.values() if len(both) == _N_WORLDS]
        self.skipped += [one for one in encoded if isinstance(one, SkippedSequence)]

    def _group_by_episode(self) -> list[list[Sequence[_Asked]]]:
        """Return the questions of each trajectory, or of both worlds of each twin."""
        episodes: dict[str, list[Sequence[_Asked]]] = defaultdict(list)
        for questions in (*((one,) for one in self._singles), *self._pairs):
            episodes[" ".join(asked.traj_id for asked in questions)].append(questions)
        return list(episodes.values())

    def draw(self, rng: random.Random, progress: float) -> list[TrainingSequence]:
        """Return the questions of a step, with their answers.

        Args:
            rng: source of all random choices.
            progress: share of the stage's steps that is done.
        """
        settings = self._settings
        grown = min(1.0, progress / settings.ramp) if settings.ramp else 1.0
        if rng.random() < settings.whole * grown:
            return self._on_trajectories(rng)
        n_others = round(settings.recalled_frames * grown)
        drawn: list[TrainingSequence] = []
        while len(drawn) < settings.per_step:
            drawn += self._some(rng, n_others)
        return drawn

    def _some(self, rng: random.Random, n_others: int) -> list[TrainingSequence]:
        """Return one question, or both of a pair."""
        settings = self._settings
        if rng.random() < settings.synthetic:
            return [self._presence(rng)]
        is_recalled = rng.random() < settings.recalled
        is_paired = bool(self._pairs) and (not self._singles or rng.random() < settings.paired)
        questions = rng.choice(self._pairs) if is_paired else (rng.choice(self._singles),)
        if not is_recalled:
            return [asked.on_clues for asked in questions]
        # Frames that do not matter, the same in both worlds, of those before the last view.
        last = questions[0].last_view
        others = set(rng.sample(range(last), min(rng.randint(0, n_others), last)))
        return [self._recalled(asked, others) for asked in questions]

    def _recalled(self, asked: _Asked, others: set[int]) -> TrainingSequence:
        """Return a question as behind a memory that recalls its clue frames and others."""
        sample = asked.sample
        last = asked.last_view
        clues = set(sample.frames) if sample.question.has_evidence else set()
        recalled = tuple(sorted((clues | others) - {last}))
        return self._encode(MEMORY, asked, frames=(*recalled, last), recalled=recalled)

    def _on_trajectories(self, rng: random.Random) -> list[TrainingSequence]:
        """Return questions on a whole trajectory as one sequence; of twins, one of each world."""
        questions = rng.choice(self._episodes)
        n = min(len(questions), self._settings.per_trajectory)
        worlds = zip(*rng.sample(questions, n), strict=True)
        return [join_branches("trajectory", [*map(self._encode_whole, asked)]) for asked in worlds]

    def _encode_whole(self, asked: _Asked) -> TrainingSequence:
        return self._encode("trajectory", asked, frames=tuple(range(asked.last_view + 1)))

    def _encode(self, context_name: str, asked: _Asked, **shown: Any) -> TrainingSequence:
        """Return a question in a context, with what that shows as fields of its sample."""
        sample = replace(asked.sample, **shown)
        context, text = CONTEXTS[context_name].request(asked.data, sample)
        return self._encoder.answer(
            "question", [*as_images(context), text], doc_target(sample.question)
        )

    def _presence(self, rng: random.Random) -> TrainingSequence:
        """Return a question for the presence of an object in one frame.

        Names are sampled by the number of frames that show them, for "yes" as for "no", so that the
        name does not give away the answer.
        """
        is_present = rng.random() < 0.5
        for name, index in self._draw_names(rng):
            column = self._dataset.types.index(name)
            if (self._dataset.visible if is_present else 1 - self._dataset.present)[index, column]:
                break
        words = noun(name)
        text = rng.choice(_PRESENCE).format(with_article(words), words)
        prompt = question_text(CONTEXTS["clues"].intro, Question("", text, (), ()))
        answer = "yes" if self._dataset.visible[index, column] else "no"
        return self._encoder.answer("synthetic", [self._dataset.frames[index], prompt], answer)

    def _draw_names(self, rng: random.Random) -> Iterator[tuple[str, int]]:
        for _ in range(_MAX_TRIES):
            (name,) = rng.choices(self._names, self._weights)
            yield name, rng.randrange(len(self._dataset.frames))
