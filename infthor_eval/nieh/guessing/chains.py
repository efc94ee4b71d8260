"""The best guess of an answer without frames.

Answers are counted after contexts from the general to the particular ("how", "how many", "how many
mugs"). Each is mixed with the one before it, and counts less the more different answers it has
(Witten and Bell's interpolation). The evidence of several such chains is multiplied. Nothing is
tuned, and nothing is drawn. Questions on a trajectory are guessed from the other trajectories
alone, so that a right guess is no memory of the answer key.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from infthor_eval.formats.question import Question
from infthor_eval.formats.question_forms import find_form
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.docs import doc_target

__all__ = [
    "Guesser",
    "HoldOut",
    "chains_of_words",
    "chains_of_words_and_count",
    "chains_of_words_and_place",
    "form_of",
    "held_out",
    "question_type",
    "words_of",
]

Chain = Sequence[Hashable]
HoldOut = Callable[[Sample], str]  # the name of what is left out when a sample is guessed
_LEADING_WORDS = 2  # the type of a question whose file names none
_STEM = 3  # leading words that tell the forms of questions apart
_PLACE = 100  # frames that count as one place
# of a log probability; what is beyond is rounding, which must not decide between equal answers
_DIGITS = 9


def chains_of_words(sample: Sample) -> list[Chain]:
    """Return chains of words: the leading ones, each later one, alone and after the first two."""
    words = words_of(sample.question)
    later = sorted(set(words[2:]))
    leading = [("leading", *words[:n]) for n in range(1, len(words) + 1)]
    return [leading, *([("word", word), ("word", *words[:2], word)] for word in later)]


def chains_of_words_and_count(sample: Sample) -> list[Chain]:
    """Return the chains of words, and one of the number of frames after the question's stem."""
    stem = words_of(sample.question)[:_STEM]
    return [*chains_of_words(sample), [("stem", *stem), ("count", *stem, len(sample.frames))]]


def chains_of_words_and_place(sample: Sample) -> list[Chain]:
    """Return the chains of words, and of the last clue's place and the clues' span."""
    stem = words_of(sample.question)[:_STEM]
    first, last = sample.frames[0], sample.frames[-1]
    last_clue = ("place", *stem, last // _PLACE)
    span = ("span", *stem, (last - first).bit_length())
    return [*chains_of_words(sample), [("stem", *stem), last_clue], [("stem", *stem), span]]


def words_of(question: Question) -> list[str]:
    """Return the words of a question in lower case."""
    return re.findall(r"\w+", question.text.lower())


def held_out(
    samples: Sequence[Sample], scenes: Mapping[str, str] = MappingProxyType({})
) -> HoldOut:
    """Return what a sample is left out with: its trajectory, or itself if there is one alone.

    Twins are left out with all twins of their trajectory.

    Args:
        samples: all samples that are guessed.
        scenes: scene by id of the trajectory, to leave out whole scenes.
    """

    def group(sample: Sample) -> str:
        return scenes.get(sample.question.traj_id, sample.question.cluster)

    is_alone = len(set(map(group, samples))) == 1
    return (lambda sample: sample.question.draw_name) if is_alone else group


class Guesser:
    """Guesses at samples from the answers to others."""

    def __init__(
        self,
        samples: Sequence[Sample],
        chains: Callable[[Sample], list[Chain]],
        hold_out: HoldOut | None = None,
    ) -> None:
        """Count the answer key; a sample is guessed without those held out, by `held_out`."""
        self._chains = chains
        self._held_out = hold_out or held_out(samples)
        self._answers = sorted({doc_target(sample.question) for sample in samples})
        self._number = {answer: number for number, answer in enumerate(self._answers)}
        self._seen: dict[Hashable, Counter[int]] = defaultdict(Counter)
        self._own: dict[tuple[str, Hashable], Counter[int]] = defaultdict(Counter)
        for sample in samples:
            self._count(sample)

    def guess(self, sample: Sample) -> str:
        """Return the likeliest answer (of equals, the first by name); empty if none was learned."""
        group = self._held_out(sample)
        counts = self._vector(self._others((), group))
        if not counts.any():
            return ""
        with np.errstate(divide="ignore"):
            prior = np.log(counts / counts.sum())
            evidence = [
                np.log(self._probability(chain, counts, group)) for chain in self._chains(sample)
            ]
        known = np.flatnonzero(counts)
        total = prior[known] + sum(logs[known] - prior[known] for logs in evidence)
        return self._answers[known[np.argmax(np.round(total, _DIGITS))]]

    def _count(self, sample: Sample) -> None:
        answer = self._number[doc_target(sample.question)]
        group = self._held_out(sample)
        for context in {(), *(context for chain in self._chains(sample) for context in chain)}:
            self._seen[context][answer] += 1
            self._own[group, context][answer] += 1

    def _others(self, context: Hashable, group: str) -> Counter[int]:
        """Return the answers after a context, without those that are left out with a question."""
        return self._seen.get(context, Counter()) - self._own.get((group, context), Counter())

    def _probability(self, chain: Chain, counts: np.ndarray, group: str) -> np.ndarray:
        mixed = counts / counts.sum()
        for context in chain:
            seen = self._others(context, group)
            n_different = len(seen)
            mixed = (
                (self._vector(seen) + n_different * mixed) / (seen.total() + n_different)
                if seen
                else mixed
            )
        return mixed

    def _vector(self, counts: Counter[int]) -> np.ndarray:
        vector = np.zeros(len(self._answers))
        vector[list(counts)] = list(counts.values())
        return vector


def form_of(question: Question) -> str:
    """Return the question's form ("Is {} in/on {}?"), or its `question_type` if it has none."""
    form = find_form(question.text)
    return question_type(question) if form is None else form.words


def question_type(question: Question) -> str:
    """Return the question's type, or its leading words in lower case if the file names no type."""
    return question.question_type or " ".join(question.text.lower().split()[:_LEADING_WORDS])
