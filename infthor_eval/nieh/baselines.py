"""Yardsticks that see no frame: the answer key itself, the best guess from the question alone, and chance."""

import random
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

from infthor_eval.errors import ModelError
from infthor_eval.formats.digests import seed_of
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing import Chain, Guesser, chains_of_words, chains_of_words_and_count
from infthor_eval.runs.baseline import BaselineSubject
from model_adapters import Subject

__all__ = ["BASELINES", "Baseline", "Predict", "question_type"]

Predict = Callable[[Sample], str]
_LEADING_WORDS = 2


def question_type(question: Question) -> str:
    """The question's own type, or its leading words in lower case where the file names no type."""
    return question.question_type or " ".join(question.text.lower().split()[:_LEADING_WORDS])


@runtime_checkable
class Baseline(Subject, Protocol):
    """What answers from the answer key and what a sample tells without its frames, and never sees one.

    The key is no part of its identity: it is part of the data's own fingerprint.
    """

    def fit(self, samples: Sequence[Sample]) -> Predict:
        """Read the whole answer key of one task; what comes of it answers that task's samples."""


class Oracle(BaselineSubject):
    """Reads the answer key: what a perfect model would score."""

    name = "oracle"

    def fit(self, samples: Sequence[Sample]) -> Predict:
        """Nothing to learn: every question carries its key."""
        return lambda sample: doc_target(sample.question)


class Blind(BaselineSubject):
    """The best guess from the question's words, learned on the other trajectories: what can be had without looking."""

    name = "blind"
    _chains: Callable[[Sample], list[Chain]] = staticmethod(chains_of_words)

    def fit(self, samples: Sequence[Sample]) -> Predict:
        """See `Guesser`."""
        return Guesser(samples, self._chains).guess


class BlindCount(Blind):
    """The same, told how many frames are shown: what their number gives away."""

    name = "blind-count"
    _chains = staticmethod(chains_of_words_and_count)


class Random(BaselineSubject):
    """An answer drawn from those of the question's type, each as likely as it is frequent."""

    name = "random"

    def identity(self) -> dict[str, Any]:
        """Name and seed."""
        return {"baseline": self.name, "seed": self._seed}

    def fit(self, samples: Sequence[Sample]) -> Predict:
        """The draw depends on the seed and the question alone, not on the order of asking."""
        seen = _answers_by_type({sample.question.id: sample.question for sample in samples}.values())

        def predict(sample: Sample) -> str:
            counts = _counts(seen, sample.question)
            draw, answers = random.Random(seed_of(f"{self._seed}\n{sample.question.id}")), sorted(counts)
            return draw.choices(answers, weights=[counts[text] for text in answers])[0]

        return predict


def _answers_by_type(questions: Iterable[Question]) -> dict[str, Counter[str]]:
    """How often each answer (several golds joined by commas) is right, by question type."""
    seen: dict[str, Counter[str]] = defaultdict(Counter)
    for question in questions:
        seen[question_type(question)][doc_target(question)] += 1
    return dict(seen)


def _counts(seen: Mapping[str, Counter[str]], question: Question) -> Counter[str]:
    asked = question_type(question)
    if asked not in seen:
        raise ModelError(f"no question of type {asked!r} was in the answer key; fit the baseline to the whole key")
    return seen[asked]


BASELINES: Mapping[str, Callable[[int], Baseline]] = {made.name: made for made in (Oracle, Blind, BlindCount, Random)}
