"""The best guess of an answer by one who sees no frame.

Answers are counted behind contexts that go from the general to the particular ("how", "how many", "how many mugs"),
each mixed with the one before it; one behind which many different answers were seen is trusted less (Witten and Bell's
interpolation). The evidence of several such chains is multiplied. Nothing is tuned, and nothing is drawn.

What is guessed at a trajectory's questions is learned from the other trajectories alone, so that a right guess is
no memory of the answer key.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Sequence

import numpy as np

from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.docs import doc_target

__all__ = ["Guesser", "chains_of_words", "chains_of_words_and_count"]

Chain = Sequence[Hashable]
_STEM = 3  # leading words that tell the forms of questions apart
_DIGITS = 9  # of a log probability; what is beyond is rounding, which must not decide between equal answers


def chains_of_words(sample: Sample) -> list[Chain]:
    """The leading words, and each later word: alone, then behind the first two."""
    words = _words(sample.question)
    later = sorted(set(words[2:]))
    leading = [("leading", *words[:n]) for n in range(1, len(words) + 1)]
    return [leading, *([("word", word), ("word", *words[:2], word)] for word in later)]


def chains_of_words_and_count(sample: Sample) -> list[Chain]:
    """The words, and how many frames are shown: behind the question's stem."""
    stem = _words(sample.question)[:_STEM]
    return [*chains_of_words(sample), [("stem", *stem), ("count", *stem, len(sample.frames))]]


def _words(question: Question) -> list[str]:
    return re.findall(r"\w+", question.text.lower())


class Guesser:
    """Guesses at samples from the answers to others."""

    def __init__(self, samples: Sequence[Sample], chains: Callable[[Sample], list[Chain]]) -> None:
        """Count.

        Args:
            samples: the answer key; of one trajectory alone, each question is guessed from the other questions.
            chains: the contexts of a sample.
        """
        self._chains = chains
        self._is_alone = len({sample.question.traj_id for sample in samples}) == 1
        self._answers = sorted({doc_target(sample.question) for sample in samples})
        self._number = {answer: number for number, answer in enumerate(self._answers)}
        self._seen: dict[Hashable, Counter[int]] = defaultdict(Counter)
        self._own: dict[tuple[str, Hashable], Counter[int]] = defaultdict(Counter)
        for sample in samples:
            self._count(sample)

    def guess(self, sample: Sample) -> str:
        """The likeliest answer, of equally likely ones the first in the alphabet; empty where nothing was learned."""
        held_out = self._held_out(sample)
        counts = self._vector(self._others((), held_out))
        if not counts.any():
            return ""
        with np.errstate(divide="ignore"):
            prior = np.log(counts / counts.sum())
            evidence = [np.log(self._probability(chain, counts, held_out)) for chain in self._chains(sample)]
        known = np.flatnonzero(counts)
        total = prior[known] + sum(item[known] - prior[known] for item in evidence)
        return self._answers[known[np.argmax(np.round(total, _DIGITS))]]

    def _count(self, sample: Sample) -> None:
        answer, held_out = self._number[doc_target(sample.question)], self._held_out(sample)
        for context in {(), *(context for chain in self._chains(sample) for context in chain)}:
            self._seen[context][answer] += 1
            self._own[held_out, context][answer] += 1

    def _held_out(self, sample: Sample) -> str:
        return sample.question.id if self._is_alone else sample.question.traj_id

    def _others(self, context: Hashable, held_out: str) -> Counter[int]:
        """Answers behind a context, without those that must not be known."""
        return self._seen.get(context, Counter()) - self._own.get((held_out, context), Counter())

    def _probability(self, chain: Chain, counts: np.ndarray, held_out: str) -> np.ndarray:
        mixed = counts / counts.sum()
        for context in chain:
            found = self._others(context, held_out)
            n_different = len(found)
            mixed = (self._vector(found) + n_different * mixed) / (found.total() + n_different) if found else mixed
        return mixed

    def _vector(self, found: Counter[int]) -> np.ndarray:
        vector = np.zeros(len(self._answers))
        vector[list(found)] = list(found.values())
        return vector
