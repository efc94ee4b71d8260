"""Guessers without frames: each guesses the questions of a file from other trajectories.

`blind` is one of them, which chooses among the others.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Flag, auto
from functools import cache, partial
from types import MappingProxyType

import numpy as np

from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.chains import (
    chains_of_words,
    chains_of_words_and_count,
    chains_of_words_and_place,
    form_of,
    guess_by_chains,
)
from infthor_eval.nieh.guessing.clue_facts import ClueFacts
from infthor_eval.nieh.guessing.folds import Fit, Folds, folds_of, split
from infthor_eval.nieh.guessing.learner import guess_by_learning
from infthor_eval.nieh.scoring import score


class Knowledge(Flag):
    """What a guesser knows of a question beside its file."""

    FILE = 0
    WORDS = auto()
    NUMBER = auto()  # of clue frames
    PLACE = auto()  # of the clue frames in the trajectory
    FACTS = auto()  # of the clue frames, without their evidence: `ClueFacts`


@dataclass(frozen=True)
class NamedGuesser:
    """A guesser.

    Attributes:
        name: its name in tables.
        knows: what it knows.
        rule: learns of samples and their folds.
    """

    name: str
    knows: Knowledge
    rule: Callable[[Sequence[QuestionVariant], Folds], Fit]

    def guess(
        self, samples: Sequence[QuestionVariant], scenes: Mapping[str, str] = MappingProxyType({})
    ) -> list[str]:
        """Return a guess for each sample of a file (on the clue frames); an empty text for none.

        A sample is guessed without those of its fold (`folds_of`), which has its trajectory, or its
        whole scene where scenes are given by trajectory.
        """
        folds = folds_of(samples, scenes)
        fit = self.rule(samples, folds)
        guesses: dict[int, str] = {}
        for fold in set(folds):
            guesses |= fit(frozenset({fold}))
        return [guesses[position] for position in range(len(samples))]


def _guess_constant(
    samples: Sequence[QuestionVariant], folds: Folds, group_of: Callable[[QuestionVariant], str]
) -> Fit:
    """Guess the constant of a group (`_constant`); of a group without answers that of all."""
    groups = list(map(group_of, samples))
    answers = [doc_target(sample.question) for sample in samples]

    def fit(out: frozenset[int]) -> dict[int, str]:
        known, unknown = split(folds, out)
        everywhere = Counter(answers[at] for at in known)
        counts: dict[str, Counter[str]] = defaultdict(Counter)
        for at in known:
            counts[groups[at]][answers[at]] += 1
        constants = {group: _constant(of_group, everywhere) for group, of_group in counts.items()}
        other = _constant(everywhere, everywhere)
        return {at: constants.get(groups[at], other) for at in unknown}

    return fit


def _constant(counts: Counter[str], everywhere: Mapping[str, int]) -> str:
    """Return the commonest answer, or one that is rarer by a standard error at most.

    Where answers are balanced, the commonest on other trajectories is the rarer one on the own, so
    the choice among near equals must not hang on counts: it is yes, else the commonest everywhere.
    """
    most = max(counts.values(), default=0)
    near = [answer for answer, n in counts.items() if most - n <= math.sqrt(most + n)]
    return min(near, key=lambda it: (it.lower() != "yes", -everywhere[it], it), default="")


def _choose(
    samples: Sequence[QuestionVariant], folds: Folds, guessers: Sequence[NamedGuesser]
) -> Fit:
    """Guess each form by the guesser that is chosen on the other folds, by its strict scores there.

    For these it is held out from each fold in turn. The first guesser is left for the one that is
    best over all forms, and that for the one that is best in a form, where they are better by more
    than a standard error.
    """
    fits = [cache(guesser.rule(samples, folds)) for guesser in guessers]
    forms = [form_of(sample.question) for sample in samples]
    score_of = cache(partial(score, scorer="strict"))

    def fit(out: frozenset[int]) -> dict[int, str]:
        known, unknown = split(folds, out)
        right = np.zeros((len(fits), len(samples)))
        by_form: dict[str, list[int]] = {forms[at]: [] for at in unknown}
        for at in known:
            by_form.setdefault(forms[at], []).append(at)
            for number, learned in enumerate(fits):
                guess = learned(out | {folds[at]})[at]
                right[number, at] = score_of(guess, samples[at].question.answers)

        def best(than: int, positions: Sequence[int]) -> int:
            of_each = right[:, positions]
            first = int(of_each.sum(axis=1).argmax())
            gains = of_each[first] - of_each[than]
            return first if gains.sum() > np.linalg.norm(gains) else than

        overall = best(0, known)
        chosen = {form: fits[best(overall, of_form)](out) for form, of_form in by_form.items()}
        return {at: chosen[forms[at]][at] for at in unknown}

    return fit


_WORDS = Knowledge.WORDS
_NUMBER = Knowledge.NUMBER
_PLACE = Knowledge.PLACE
GUESSERS = (
    NamedGuesser(
        "one answer a file", Knowledge.FILE, partial(_guess_constant, group_of=lambda _: "")
    ),
    NamedGuesser(
        "one answer a form",
        _WORDS,
        partial(_guess_constant, group_of=lambda sample: form_of(sample.question)),
    ),
    NamedGuesser("words", _WORDS, partial(guess_by_chains, chains=chains_of_words)),
    NamedGuesser(
        "words, number of frames",
        _WORDS | _NUMBER,
        partial(guess_by_chains, chains=chains_of_words_and_count),
    ),
    NamedGuesser(
        "words, place of the clues",
        _WORDS | _PLACE,
        partial(guess_by_chains, chains=chains_of_words_and_place),
    ),
    NamedGuesser("learner: words", _WORDS, partial(guess_by_learning, number=False, place=False)),
    NamedGuesser(
        "learner: words, number of frames",
        _WORDS | _NUMBER,
        partial(guess_by_learning, number=True, place=False),
    ),
    NamedGuesser(
        "learner: words, number, place",
        _WORDS | _NUMBER | _PLACE,
        partial(guess_by_learning, number=True, place=True),
    ),
)


def facts_guesser(facts: Mapping[str, Sequence[ClueFacts]]) -> NamedGuesser:
    """Return the guesser that also knows facts of the clue frames, by id of the question."""
    return NamedGuesser(
        "learner: words, number, place, facts of the clues",
        _WORDS | _NUMBER | _PLACE | Knowledge.FACTS,
        partial(guess_by_learning, number=True, place=True, facts=facts),
    )


def blind_guesser(knowledge: Knowledge) -> NamedGuesser:
    """Return `blind`, which chooses among a constant a form and guessers that know no more."""
    guessers = [it for it in GUESSERS if it.knows and it.knows in knowledge]
    return NamedGuesser("blind", knowledge, partial(_choose, guessers=guessers))
