"""Random questions for the small model: on their clue frames, behind memories, on trajectories.

Both questions of a pair of twins are in one step, with the same frames by number: what differs
between the two worlds is then all that there is to learn from them.
"""

import random
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

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
from model_adapters import Part

__all__ = ["QuestionSampler", "question_intro"]

_LEAST_FRAMES = 20  # frames that have to show a type before synthetic questions ask for it
_PRESENCE = ("Have you seen {0}?", "Is there any {1} in this room?")
_MAX_TRIES = 200
_Asked = tuple[NiehSet, Sample]  # a question on its clue frames, with its set


def question_intro() -> str:
    """Return the text that precedes every question on clue frames."""
    return question_text(CONTEXTS["clues"].intro, Question("", "", (), ())).rstrip()


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
        self._on_clues: list[TrainingSequence] = []
        self._asked: list[_Asked] = []
        self._pairs: list[tuple[_Asked, ...]] = []
        for folder in folders:
            self._read(folder, limit)
        self._episodes = self._group_by_episode()
        counts = dict(zip(dataset.types, dataset.visible.sum(0).tolist(), strict=True))
        frequent = {name: count for name, count in counts.items() if count >= _LEAST_FRAMES}
        self._names, self._weights = list(frequent), list(frequent.values())

    def __bool__(self) -> bool:
        """Return True if there is any recorded question."""
        return bool(self._on_clues)

    def _read(self, folder: Path, limit: int) -> None:
        samples = find_samples({"data": str(folder), "context": "clues"})
        by_pair: dict[str, list[_Asked]] = defaultdict(list)
        for sample in samples.samples:
            if sample.question.pair:
                by_pair[sample.question.pair].append((samples.data, sample))
            else:
                self._asked.append((samples.data, sample))
        self._pairs += [tuple(both) for both in by_pair.values()]
        for encoded in question_sequences(self._encoder, samples, limit):
            if isinstance(encoded, TrainingSequence):
                self._on_clues.append(encoded)
            else:
                self.skipped.append(encoded)

    def _group_by_episode(self) -> list[list[list[_Asked]]]:
        """Return the questions of each trajectory, or of both worlds of each twin."""
        episodes: dict[str, list[list[_Asked]]] = defaultdict(list)
        for one in self._asked:
            episodes[one[1].question.traj_id].append([one])
        for both in self._pairs:
            episodes[" ".join(sample.question.traj_id for _, sample in both)].append([*both])
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
        if self._pairs and rng.random() < settings.paired:
            both = rng.choice(self._pairs)
            others = self._draw_others(rng, both[0], n_others) if is_recalled else None
            return [self._encode(asked, others) for asked in both]
        if not is_recalled:
            return [rng.choice(self._on_clues)]
        asked = rng.choice(self._asked)
        return [self._encode(asked, self._draw_others(rng, asked, n_others))]

    def _draw_others(self, rng: random.Random, asked: _Asked, most: int) -> set[int]:
        """Return frames that do not matter, of those before the last view."""
        data, sample = asked
        last = len(data.frames(sample.question.traj_id)) - 1
        return set(rng.sample(range(last), min(rng.randint(0, most), last)))

    def _encode(self, asked: _Asked, others: set[int] | None) -> TrainingSequence:
        """Return a question on its clue frames, or as behind a memory that recalls others, too."""
        data, sample = asked
        if others is None:
            context, text = CONTEXTS["clues"].request(data, sample)
            return self._answer([*as_images(context), text], sample)
        last = len(data.frames(sample.question.traj_id)) - 1
        clues = set(sample.frames) if sample.question.has_evidence else set()
        recalled = tuple(sorted((clues | others) - {last}))
        remembered = replace(sample, frames=(*recalled, last), recalled=recalled)
        context, text = CONTEXTS[MEMORY].request(data, remembered)
        return self._answer([*as_images(context), text], sample)

    def _on_trajectories(self, rng: random.Random) -> list[TrainingSequence]:
        """Return questions on a whole trajectory as one sequence; of twins, one of each world."""
        questions = rng.choice(self._episodes)
        n = min(len(questions), self._settings.per_trajectory)
        worlds = zip(*rng.sample(questions, n), strict=True)
        return [join_branches("trajectory", [*map(self._encode_whole, asked)]) for asked in worlds]

    def _encode_whole(self, asked: _Asked) -> TrainingSequence:
        data, sample = asked
        n_frames = len(data.frames(sample.question.traj_id))
        context, text = CONTEXTS["trajectory"].request(
            data, replace(sample, frames=tuple(range(n_frames)))
        )
        return self._answer([*as_images(context), text], sample)

    def _answer(self, parts: Sequence[Part], sample: Sample) -> TrainingSequence:
        return self._encoder.answer("question", parts, doc_target(sample.question))

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
