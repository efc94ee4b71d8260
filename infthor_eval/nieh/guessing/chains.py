"""The best guess of an answer without frames.

Answers are counted after contexts from the general to the particular ("how", "how many", "how many
mugs"). Each is mixed with the one before it, and counts less the more different answers it has
(Witten and Bell's interpolation). The evidence of several such chains is multiplied. Nothing is
tuned, and nothing is drawn.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Sequence

import numpy as np

from infthor_eval.formats.question import Question
from infthor_eval.formats.question_forms import find_form
from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.folds import Fit, Folds, split

Chain = Sequence[Hashable]
_LEADING_WORDS = 2  # the type of a question whose file names none
_STEM = 3  # leading words that tell the forms of questions apart
_LONGEST = 64  # words of the longest leading chain: all of a text's would grow with its square
_PLACE = 100  # frames that count as one place
# of a log probability; what is beyond is rounding, which must not decide between equal answers
_DIGITS = 9


def chains_of_words(sample: QuestionVariant) -> list[Chain]:
    """Return chains of words: the leading ones, each later one, alone and after the first two."""
    words = words_of(sample.question)
    later = sorted(set(words[2:]))
    leading = [("leading", *words[:n]) for n in range(1, min(len(words), _LONGEST) + 1)]
    return [leading, *([("word", word), ("word", *words[:2], word)] for word in later)]


def chains_of_words_and_count(sample: QuestionVariant) -> list[Chain]:
    """Return the chains of words, and one of the number of frames after the question's stem."""
    stem = words_of(sample.question)[:_STEM]
    return [*chains_of_words(sample), [("stem", *stem), ("count", *stem, len(sample.frames))]]


def chains_of_words_and_place(sample: QuestionVariant) -> list[Chain]:
    """Return the chains of words, and of the last clue's place and the clues' span."""
    stem = words_of(sample.question)[:_STEM]
    first, last = sample.frames[0], sample.frames[-1]
    last_clue = ("place", *stem, last // _PLACE)
    span = ("span", *stem, (last - first).bit_length())
    return [*chains_of_words(sample), [("stem", *stem), last_clue], [("stem", *stem), span]]


def words_of(question: Question) -> list[str]:
    """Return the words of a question in lower case."""
    return re.findall(r"\w+", question.text.lower())


def guess_by_chains(
    samples: Sequence[QuestionVariant],
    folds: Folds,
    chains: Callable[[QuestionVariant], list[Chain]],
) -> Fit:
    """Return the guesser by some chains: the likeliest answer (of equals, the first by name)."""
    targets = [doc_target(sample.question) for sample in samples]
    chains_of = list(map(chains, samples))

    def fit(out: frozenset[int]) -> dict[int, str]:
        known, unknown = split(folds, out)
        counts = _Counts([targets[at] for at in known], [chains_of[at] for at in known])
        return {at: counts.guess(chains_of[at]) for at in unknown}

    return fit


class _Counts:
    """The answers to some samples, counted after their contexts."""

    def __init__(self, targets: Sequence[str], chains_of: Sequence[Sequence[Chain]]) -> None:
        self._answers = sorted(set(targets))
        number = {answer: number for number, answer in enumerate(self._answers)}
        self._seen: dict[Hashable, Counter[int]] = defaultdict(Counter)
        for target, chains in zip(targets, chains_of, strict=True):
            for context in {(), *(context for chain in chains for context in chain)}:
                self._seen[context][number[target]] += 1

    def guess(self, chains: Sequence[Chain]) -> str:
        """Return the likeliest answer after some chains; empty if none was learned."""
        if not self._answers:
            return ""
        counts = self._vector(self._seen[()])
        prior = np.log(counts / counts.sum())
        evidence = (np.log(self._probability(chain, counts)) - prior for chain in chains)
        total = prior + sum(evidence)
        return self._answers[np.argmax(np.round(total, _DIGITS))]

    def _probability(self, chain: Chain, counts: np.ndarray) -> np.ndarray:
        mixed = counts / counts.sum()
        for context in chain:
            seen = self._seen.get(context)
            if seen:
                mixed = (self._vector(seen) + len(seen) * mixed) / (seen.total() + len(seen))
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
