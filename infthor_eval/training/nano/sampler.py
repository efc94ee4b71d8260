"""What the small model is told: questions of sets, questions made up on any frame, and histories to act from."""

import random
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.household.sequence_text import MARKS
from infthor_eval.household.wording import noun, with_article
from infthor_eval.nieh.contexts import CONTEXTS
from infthor_eval.nieh.prompts import question_text
from infthor_eval.nieh.samples import find_samples
from infthor_eval.plans.segments import PlanSegment
from infthor_eval.training.action_sequences import single_plans, windows
from infthor_eval.training.data import read_history, trajectory_names
from infthor_eval.training.encoding import Encoder, SkippedItem, TrainingSequence
from infthor_eval.training.nano.frame_dataset import FrameDataset
from infthor_eval.training.nano.network import spellings
from infthor_eval.training.nano.synthetic_plans import SyntheticPlans
from infthor_eval.training.question_sequences import question_sequences
from model_adapters import Part

__all__ = ["SequenceSampler", "corpus_texts", "question_intro"]

_LEAST_SEEN = 20  # frames that show a type that is asked about in questions that are made up
_FORMS = ("Have you seen {0}?", "Is there any {1} in this room?")
_TRIES = 200


def question_intro() -> str:
    """What every question on clue frames begins with."""
    return question_text(CONTEXTS["clues"].intro, Question("", "", (), ())).rstrip()


def corpus_texts(folders: Sequence[Path], types: Sequence[str]) -> Iterator[str]:
    """Everything that is said in sets, for a tokenizer that is to know its words."""
    for object_type in types:
        yield from spellings(object_type)
        yield object_type
    for folder in folders:
        for path in sorted((folder / "metadata").glob("*/traj.txt")):
            said = path.read_text(encoding="utf-8").replace("<image>", " ")
            for mark in MARKS:
                said = said.replace(mark, "\n")
            yield from said.splitlines()
        for question in NiehSet(folder).questions:
            yield f" {question.text}"
            yield from (f"{way}{answer}" for answer in question.answers for way in ("", " "))
    yield from map(str, range(30))
    yield question_intro()


class SequenceSampler:
    """Sequences to learn from, drawn by a seed.

    Args:
        encoder: makes them.
        folders: of replayed sets, with questions.
        album: all their frames.
        window_tokens: of a history at most.
        seed: of the draws.

    Attributes:
        left_out: what no sequence could be made of.

    Raises:
        DataError: there is nothing to learn answering or acting from.
    """

    def __init__(
        self, encoder: Encoder, folders: Sequence[Path], dataset: FrameDataset, *, window_tokens: int, seed: int
    ) -> None:
        self._encoder = encoder
        self._album = dataset
        self._limit = window_tokens
        self._draw = random.Random(seed)
        self._questions: list[TrainingSequence] = []
        self._windows: list[TrainingSequence] = []
        self._plans: list[TrainingSequence] = []
        self.left_out: list[SkippedItem] = []
        carried_out: list[tuple[str, list[str]]] = []
        for folder in folders:
            asked = find_samples({"data": str(folder), "context": "clues"})
            self._questions += self._kept(question_sequences(encoder, asked, window_tokens))
            for segments in self._histories(NiehSet(folder)):
                carried_out += [(segment.plan, [action for action, _ in segment.steps]) for segment in segments]
        self._orders = SyntheticPlans(carried_out)
        for what, pool in (("question", self._questions), ("history", self._windows), ("plan", self._orders)):
            if not pool:
                raise DataError(f"{', '.join(map(str, folders))}: no {what} to learn from; give another set")
        counts = dataset.shown.sum(0).tolist()
        often = {name: count for name, count in zip(dataset.types, counts, strict=True) if count >= _LEAST_SEEN}
        self._names, self._weights = list(often), list(often.values())

    def _histories(self, data: NiehSet) -> Iterator[list[PlanSegment]]:
        """Read the histories of a set; one that cannot be read is left out."""
        for name in trajectory_names(data):
            try:
                _, segments = read_history(data, name)
                cut = [*windows(self._encoder, name, segments, self._limit)]
                alone = [*single_plans(self._encoder, name, segments)]
            except DataError as error:
                self.left_out.append(SkippedItem(name, str(error)))
                continue
            self._windows += self._kept(cut)
            self._plans += [plan for plan in alone if plan.n_tokens <= self._limit]
            yield segments

    def _kept(self, made: Iterable[TrainingSequence | SkippedItem]) -> Iterator[TrainingSequence]:
        for item in made:
            if isinstance(item, TrainingSequence):
                yield item
            else:
                self.left_out.append(item)

    def questions(self, n: int, made_up: float) -> list[TrainingSequence]:
        """Some questions with their answers, a share of them made up."""
        return [
            self._presence() if self._draw.random() < made_up else self._draw.choice(self._questions) for _ in range(n)
        ]

    def histories(self, n_windows: int, n_plans: int, alone: float) -> list[TrainingSequence]:
        """Some histories with their actions.

        Args:
            n_windows: this many windows,
            n_plans: or this many single plans,
            alone: with this probability.
        """
        pool, n = (self._plans, n_plans) if self._draw.random() < alone else (self._windows, n_windows)
        return [self._draw.choice(pool) for _ in range(n)]

    def orders(self, n: int) -> list[TrainingSequence]:
        """Some plans that are made up, without a frame, with their actions."""
        return [self._encoder.order("made up", *self._orders.drawn(self._draw)) for _ in range(n)]

    def frames(self, n: int) -> list[int]:
        """Places of some frames in the album."""
        return self._draw.sample(range(len(self._album.frames)), min(n, len(self._album.frames)))

    def way(self, n_spellings: int) -> int:
        """One of the ways of writing names."""
        return self._draw.randrange(n_spellings)

    def _presence(self) -> TrainingSequence:
        """A question for an object's presence on one frame; the name tells nothing of the answer.

        Names are drawn as often as frames show them, for yes as for no.
        """
        is_there = self._draw.random() < 0.5
        for _ in range(_TRIES):
            (name,) = self._draw.choices(self._names, self._weights)
            place = self._draw.randrange(len(self._album.frames))
            kind = self._album.types.index(name)
            if (self._album.shown if is_there else 1 - self._album.present)[place, kind]:
                break
        words = noun(name)
        text = self._draw.choice(_FORMS).format(with_article(words), words)
        asked = question_text(CONTEXTS["clues"].intro, Question("", text, (), ()))
        parts: list[Part] = [self._album.frames[place], asked]
        return self._encoder.answer("made up", parts, "yes" if self._album.shown[place, kind] else "no")
