"""Baselines: the answer key, what is had from the question alone, chance, and two of twins.

`flip` and `hash` do not know which world they are asked about, and say something else in each all
the same: what they have of pairs right is no memory.

To add a baseline of NIEH: a class in `BASELINES` here, and its name in `infthor_eval/suites.py`.
"""

import random
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import ContextPart, QuestionVariant
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.blind import find_blind, sample_on_clues, visible_knowledge
from infthor_eval.nieh.guessing.chains import question_type
from infthor_eval.nieh.guessing.folds import held_out
from infthor_eval.nieh.twins import is_first, paired_with
from infthor_eval.runs.suite import BaselineSubject
from infthor_eval.storage.digests import seed_of
from model_adapters import Subject

_RULES = 2  # of `blind` and `random`: with another number earlier replies are not taken again


class Predict(Protocol):
    """Answers a sample of a set, given what is shown of it."""

    def __call__(self, sample: QuestionVariant, shown: Sequence[ContextPart] = (), /) -> str:
        """Return the answer."""


@runtime_checkable
class Baseline(Subject, Protocol):
    """A subject that answers from the answer key and sees no picture; the data's hash covers it."""

    def fit(self, data: NiehSet, context: str) -> Predict:
        """Return a function that answers samples of a set in a context of that name."""


class Oracle(BaselineSubject):
    """The answer key itself: the score of a perfect model."""

    name = "oracle"

    def fit(self, data: NiehSet, context: str) -> Predict:
        """See `Baseline`; every question carries its key."""
        return lambda sample, _shown=(): doc_target(sample.question)


class Blind(BaselineSubject):
    """What is had without a frame: a question's words are known, and other trajectories."""

    name = "blind"

    def identity(self) -> dict[str, Any]:
        """Return name and number of the rules."""
        return {"baseline": self.name, "rules": _RULES}

    def fit(self, data: NiehSet, context: str) -> Predict:
        """See `Baseline`; it is learned when the first question is asked (`find_blind`)."""
        knowledge = visible_knowledge(context)
        return lambda sample, _shown=(): find_blind(data, knowledge)[sample.question.id].reply


class Random(BaselineSubject):
    """An answer drawn from those of the question's type, each as likely as it is frequent."""

    name = "random"

    def identity(self) -> dict[str, Any]:
        """Return name, number of the rules and seed."""
        return {"baseline": self.name, "rules": _RULES, "seed": self._seed}

    def fit(self, data: NiehSet, context: str) -> Predict:
        """See `Baseline`; a draw depends on seed and question alone, not on the order of asking."""
        counts_for = _answers_elsewhere(data)

        def predict(sample: QuestionVariant, _shown: Sequence[ContextPart] = ()) -> str:
            counts = counts_for(sample)
            draw = random.Random(seed_of(f"{self._seed}\n{sample.question.id}"))
            answers = sorted(counts) or [""]
            return draw.choices(answers, weights=[counts[text] or 1 for text in answers])[0]

        return predict


class _OneOfTwo(BaselineSubject):
    """One of the two answers that are commonest for the question's type."""

    def fit(self, data: NiehSet, context: str) -> Predict:
        """See `Baseline`."""
        counts_for = _answers_elsewhere(data)

        def predict(sample: QuestionVariant, shown: Sequence[ContextPart] = ()) -> str:
            counts = counts_for(sample)
            two = sorted(counts, key=lambda text: (-counts[text], text))[:2] or [""]
            return two[-1 if self._takes_second(sample.question, shown, data) else 0]

        return predict

    def _takes_second(
        self, question: Question, shown: Sequence[ContextPart], data: NiehSet
    ) -> bool:
        raise NotImplementedError


class Flip(_OneOfTwo):
    """Sees nothing, and answers the other way when the same words come a second time."""

    name = "flip"

    def _takes_second(
        self, question: Question, shown: Sequence[ContextPart], data: NiehSet
    ) -> bool:
        return bool(question.pair) and not is_first(question, paired_with(data, question))


class Hash(_OneOfTwo):
    """Decides by a hash of question and frames: it tells worlds apart, not which is which."""

    name = "hash"

    def _takes_second(
        self, question: Question, shown: Sequence[ContextPart], data: NiehSet
    ) -> bool:
        frames = [part.digest for part in as_images(shown) if isinstance(part, FrameRef)]
        return bool(seed_of("\n".join([question.text, *frames])) % 2)


def _answers_elsewhere(data: NiehSet) -> Callable[[QuestionVariant], Counter[str]]:
    """Return what counts the answers to a question's type, without those of its own fold."""
    hold_out = held_out([sample_on_clues(question) for question in data.questions])
    seen: dict[str, Counter[str]] = defaultdict(Counter)
    own: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
    for question in {question.id: question for question in data.questions}.values():
        kind, answer = question_type(question), doc_target(question)
        seen[kind][answer] += 1
        own[kind, hold_out(sample_on_clues(question))][answer] += 1

    def counts_for(sample: QuestionVariant) -> Counter[str]:
        kind = question_type(sample.question)
        return seen[kind] - own[kind, hold_out(sample)]

    return counts_for


BASELINES: Mapping[str, Callable[[int], Baseline]] = {
    kind.name: kind for kind in (Oracle, Blind, Random, Flip, Hash)
}
