"""Baselines: the answer key, the best guess from the question alone, chance, and two of twins.

`flip` and `hash` do not know which world they are asked about, and say something else in each all
the same: what they have of pairs right is no memory.

To add a baseline of NIEH: a class in `BASELINES` here, and its name in `infthor_eval/suites.py`.
"""

import random
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import ContextPart, Sample
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.chains import (
    Chain,
    Guesser,
    chains_of_words,
    chains_of_words_and_count,
    question_type,
)
from infthor_eval.nieh.twins import first_world
from infthor_eval.runs.suite import BaselineSubject
from infthor_eval.storage.digests import seed_of
from model_adapters import Subject

__all__ = ["BASELINES", "Baseline", "Predict"]


class Predict(Protocol):
    """Answers a sample of the key, given what is shown of it."""

    def __call__(self, sample: Sample, shown: Sequence[ContextPart] = (), /) -> str:
        """Return the answer."""


@runtime_checkable
class Baseline(Subject, Protocol):
    """A subject that answers from the answer key and sees no picture; the data's hash covers it."""

    def fit(self, samples: Sequence[Sample]) -> Predict:
        """Read the whole answer key of one task, and return a function that answers its samples."""


class Oracle(BaselineSubject):
    """The answer key itself: the score of a perfect model."""

    name = "oracle"

    def fit(self, samples: Sequence[Sample]) -> Predict:
        """See `Baseline`; every question carries its key."""
        return lambda sample, _shown=(): doc_target(sample.question)


class Blind(BaselineSubject):
    """The best guess from the question's words, learned on the other trajectories."""

    name = "blind"
    _chains: Callable[[Sample], list[Chain]] = staticmethod(chains_of_words)

    def fit(self, samples: Sequence[Sample]) -> Predict:
        """See `Guesser`; each file of a set is learned alone, as the published scripts ask."""
        by_file: dict[str, list[Sample]] = defaultdict(list)
        for sample in samples:
            by_file[sample.question.file].append(sample)
        guessers = {file: Guesser(of_file, self._chains) for file, of_file in by_file.items()}
        return lambda sample, _shown=(): guessers[sample.question.file].guess(sample)


class BlindCount(Blind):
    """`Blind` that also knows the number of shown frames."""

    name = "blind-count"
    _chains = staticmethod(chains_of_words_and_count)


class Random(BaselineSubject):
    """An answer drawn from those of the question's type, each as likely as it is frequent."""

    name = "random"

    def identity(self) -> dict[str, Any]:
        """Return name and seed."""
        return {"baseline": self.name, "seed": self._seed}

    def fit(self, samples: Sequence[Sample]) -> Predict:
        """See `Baseline`; a draw depends on seed and question alone, not on the order of asking."""
        seen: dict[str, Counter[str]] = defaultdict(Counter)
        for question in {sample.question.id: sample.question for sample in samples}.values():
            seen[question_type(question)][doc_target(question)] += 1

        def predict(sample: Sample, _shown: Sequence[ContextPart] = ()) -> str:
            counts = _counts(seen, sample.question)
            draw = random.Random(seed_of(f"{self._seed}\n{sample.question.id}"))
            answers = sorted(counts)
            return draw.choices(answers, weights=[counts[text] for text in answers])[0]

        return predict


def _counts(seen: Mapping[str, Counter[str]], question: Question) -> Counter[str]:
    kind = question_type(question)
    if kind not in seen:
        raise ModelError(
            f"no question of type {kind!r} was in the answer key; fit the baseline to the whole key"
        )
    return seen[kind]


class _OneOfTwo(BaselineSubject):
    """One of the two answers that are commonest for the question's type on other trajectories."""

    def fit(self, samples: Sequence[Sample]) -> Predict:
        """See `Baseline`."""
        seen: dict[str, Counter[str]] = defaultdict(Counter)
        own: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
        worlds: dict[str, set[str]] = defaultdict(set)
        for question in {sample.question.id: sample.question for sample in samples}.values():
            kind = question_type(question)
            seen[kind][doc_target(question)] += 1
            own[kind, question.cluster][doc_target(question)] += 1
            worlds[question.pair].add(question.traj_id)

        def predict(sample: Sample, shown: Sequence[ContextPart] = ()) -> str:
            question = sample.question
            kind = question_type(question)
            counts = seen[kind] - own[kind, question.cluster] or seen[kind]
            two = sorted(counts, key=lambda text: (-counts[text], text))[:2]
            takes_second = self._takes_second(question, shown, worlds[question.pair])
            return two[-1 if takes_second else 0] if two else ""

        return predict

    def _takes_second(
        self, question: Question, shown: Sequence[ContextPart], worlds: Collection[str]
    ) -> bool:
        raise NotImplementedError


class Flip(_OneOfTwo):
    """Sees nothing, and answers the other way when the same words come a second time."""

    name = "flip"

    def _takes_second(
        self, question: Question, shown: Sequence[ContextPart], worlds: Collection[str]
    ) -> bool:
        return bool(question.pair) and question.traj_id != first_world(worlds)


class Hash(_OneOfTwo):
    """Decides by a hash of question and frames: it tells worlds apart, not which is which."""

    name = "hash"

    def _takes_second(
        self, question: Question, shown: Sequence[ContextPart], worlds: Collection[str]
    ) -> bool:
        frames = [part.digest for part in as_images(shown) if isinstance(part, FrameRef)]
        return bool(seed_of("\n".join([question.text, *frames])) % 2)


BASELINES: Mapping[str, Callable[[int], Baseline]] = {
    kind.name: kind for kind in (Oracle, Blind, BlindCount, Random, Flip, Hash)
}
