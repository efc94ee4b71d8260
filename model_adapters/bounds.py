"""Yardsticks that see no frame: the answer key itself, the best guess from the question alone, and chance."""

import hashlib
import random
from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import Any

from infthor_eval.errors import ModelError
from infthor_eval.formats.question import Question
from model_adapters.options import NoOptions

__all__ = ["Blind", "Oracle", "Random", "question_type"]

_LEADING_WORDS = 2


def question_type(question: Question) -> str:
    """The question's own type, or its leading words in lower case where the file names no type."""
    return question.question_type or " ".join(question.text.lower().split()[:_LEADING_WORDS])


def _key(question: Question) -> str:
    return ", ".join(str(answer) for answer in question.answers)


class Oracle:
    """Reads the answer key: what a perfect model would score."""

    Options = NoOptions

    def __init__(self, name: str = "oracle") -> None:
        self.name = name

    @classmethod
    def build(cls, name: str, options: NoOptions, seed: int) -> "Oracle":  # noqa: ARG003
        """An oracle; it has no options and nothing random."""
        return cls(name)

    def identity(self) -> dict[str, Any]:
        """Name alone: the answers are part of the data's own fingerprint."""
        return {"bound": self.name}

    def study(self, questions: Sequence[Question]) -> None:
        """Nothing to learn: every question carries its key."""

    def answer(self, question: Question) -> str:
        """The gold answers, joined by commas."""
        return _key(question)


class _FromAnswers:
    """A bound that answers with what it saw in the key for questions of the same type."""

    def __init__(self) -> None:
        self._seen: dict[str, Counter[str]] = {}

    def study(self, questions: Sequence[Question]) -> None:
        """Count the answers (several golds joined by commas) of each question type."""
        seen: dict[str, Counter[str]] = defaultdict(Counter)
        for question in questions:
            seen[question_type(question)][_key(question)] += 1
        self._seen = dict(seen)

    def _answers(self, question: Question) -> Counter[str]:
        kind = question_type(question)
        if kind not in self._seen:
            raise ModelError(f"no question of type {kind!r} was studied; give study() the whole answer key")
        return self._seen[kind]


class Blind(_FromAnswers):
    """The most frequent answer of the question's type: what can be had without looking."""

    Options = NoOptions

    def __init__(self, name: str = "blind") -> None:
        super().__init__()
        self.name = name

    @classmethod
    def build(cls, name: str, options: NoOptions, seed: int) -> "Blind":  # noqa: ARG003
        """A blind bound; it has no options and nothing random."""
        return cls(name)

    def identity(self) -> dict[str, Any]:
        """Name alone: what it learns is in the data's own fingerprint."""
        return {"bound": self.name}

    def answer(self, question: Question) -> str:
        """The majority answer; of equally frequent ones the first in the alphabet.

        Raises:
            ModelError: no question of this type was studied.
        """
        counts = self._answers(question)
        return min(counts, key=lambda text: (-counts[text], text))


class Random(_FromAnswers):
    """An answer drawn from those of the question's type, each as likely as it is frequent."""

    Options = NoOptions

    def __init__(self, seed: int, name: str = "random") -> None:
        super().__init__()
        self.name = name
        self._seed = seed

    @classmethod
    def build(cls, name: str, options: NoOptions, seed: int) -> "Random":  # noqa: ARG003
        """A random bound of this seed."""
        return cls(seed, name)

    def identity(self) -> dict[str, Any]:
        """Name and seed."""
        return {"bound": self.name, "seed": self._seed}

    def answer(self, question: Question) -> str:
        """A draw that depends on the seed and the question alone, not on the order of asking.

        Raises:
            ModelError: no question of this type was studied.
        """
        counts = self._answers(question)
        digest = hashlib.blake2b(f"{self._seed}\n{question.id}".encode(), digest_size=8).digest()
        draw = random.Random(int.from_bytes(digest))
        answers = sorted(counts)
        return draw.choices(answers, weights=[counts[text] for text in answers])[0]
