"""Baselines without frames: the answer key, what is had from the question alone, and chance.

To add a baseline of NIEH: a class in `BASELINES` here, and its name in `infthor_eval/suites.py`.
"""

import random
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from typing import Any, Protocol, runtime_checkable

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.blind import find_blind, sample_on_clues, visible_knowledge
from infthor_eval.nieh.guessing.chains import question_type
from infthor_eval.nieh.guessing.folds import held_out
from infthor_eval.runs.suite import BaselineSubject
from infthor_eval.storage.digests import seed_of
from model_adapters import Subject

__all__ = ["BASELINES", "Baseline", "Predict"]

Predict = Callable[[Sample], str]
_RULES = 2  # of `blind` and `random`: with another number earlier replies are not taken again


@runtime_checkable
class Baseline(Subject, Protocol):
    """A subject that answers from the answer key, without frames; the data's hash covers it."""

    def fit(self, data: NiehSet, context: str) -> Predict:
        """Return a function that answers samples of a set in a context of that name."""


class Oracle(BaselineSubject):
    """The answer key itself: the score of a perfect model."""

    name = "oracle"

    def fit(self, data: NiehSet, context: str) -> Predict:
        """See `Baseline`; every question carries its key."""
        return lambda sample: doc_target(sample.question)


class Blind(BaselineSubject):
    """What is had without a frame: a question's words are known, and other trajectories."""

    name = "blind"

    def identity(self) -> dict[str, Any]:
        """Return name and number of the rules."""
        return {"baseline": self.name, "rules": _RULES}

    def fit(self, data: NiehSet, context: str) -> Predict:
        """See `Baseline`; it is learned when the first question is asked (`find_blind`)."""
        knowledge = visible_knowledge(context)
        return lambda sample: find_blind(data, knowledge)[sample.question.id].reply


class Random(BaselineSubject):
    """An answer drawn from those to questions of the type on other trajectories, each as likely as
    it is frequent there; empty if there are none."""

    name = "random"

    def identity(self) -> dict[str, Any]:
        """Return name, number of the rules and seed."""
        return {"baseline": self.name, "rules": _RULES, "seed": self._seed}

    def fit(self, data: NiehSet, context: str) -> Predict:
        """See `Baseline`; a draw depends on seed and question alone, not on the order of asking."""
        hold_out = held_out([sample_on_clues(question) for question in data.questions])
        seen: dict[str, Counter[str]] = defaultdict(Counter)
        own: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
        for question in {question.id: question for question in data.questions}.values():
            kind, answer = question_type(question), doc_target(question)
            seen[kind][answer] += 1
            own[kind, hold_out(sample_on_clues(question))][answer] += 1

        def predict(sample: Sample) -> str:
            kind = question_type(sample.question)
            counts = seen[kind] - own[kind, hold_out(sample)]
            draw = random.Random(seed_of(f"{self._seed}\n{sample.question.id}"))
            answers = sorted(counts) or [""]
            return draw.choices(answers, weights=[counts[text] or 1 for text in answers])[0]

        return predict


BASELINES: Mapping[str, Callable[[int], Baseline]] = {
    kind.name: kind for kind in (Oracle, Blind, Random)
}
