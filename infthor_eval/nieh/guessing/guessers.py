"""Guessers without frames: each guesses the questions of a file from other trajectories.

`blind` is one of them, which chooses among the others.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Flag, auto
from functools import cache, partial

from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.chains import (
    chains_of_words,
    chains_of_words_and_count,
    chains_of_words_and_place,
    form_of,
    guess_by_chains,
)
from infthor_eval.nieh.guessing.clue_facts import ClueFacts
from infthor_eval.nieh.guessing.folds import (
    Fit,
    Folds,
    HoldOut,
    folds_of,
    guess_held_out,
    held_out,
)
from infthor_eval.nieh.guessing.learner import guess_by_learning
from infthor_eval.nieh.scoring import score

__all__ = ["GUESSERS", "Knowledge", "NamedGuesser", "blind_guesser", "facts_guesser"]


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
    rule: Callable[[Sequence[Sample], Folds], Fit]

    def guess(self, samples: Sequence[Sample], hold_out: HoldOut | None = None) -> list[str]:
        """Return a guess for each sample of a file (on the clue frames); an empty text for none.

        A sample is guessed without those that are held out with it; by default see `held_out`.
        """
        folds = folds_of(samples, hold_out or held_out(samples))
        return guess_held_out(self.rule(samples, folds), folds)


def _guess_constant(
    samples: Sequence[Sample], folds: Folds, group_of: Callable[[Sample], str]
) -> Fit:
    """BlindGuess the commonest answer of a group; of equals the first by name."""
    groups = list(map(group_of, samples))
    answers = [doc_target(sample.question) for sample in samples]

    def fit(out: frozenset[int]) -> dict[int, str]:
        counts: dict[str, Counter[str]] = defaultdict(Counter)
        for group, answer, fold in zip(groups, answers, folds, strict=True):
            if fold not in out:
                counts[group][answer] += 1
        return {at: _commonest(counts[groups[at]]) for at, fold in enumerate(folds) if fold in out}

    return fit


def _commonest(counts: Counter[str], everywhere: Mapping[str, int] = Counter()) -> str:
    """Return the commonest answer; of equals the commoner one everywhere, then the first."""
    return min(
        counts, key=lambda answer: (-counts[answer], -everywhere[answer], answer), default=""
    )


def _choose(samples: Sequence[Sample], folds: Folds, guessers: Sequence[NamedGuesser]) -> Fit:
    """BlindGuess each form as is best on the other folds: by its commonest answer, or by a guesser.

    That is chosen by strict scores; guessers are scored on questions held out from them in turn,
    and of equals the first is taken. A form that is in no other fold has the file's commonest
    answer.
    """
    fits = [cache(guesser.rule(samples, folds)) for guesser in guessers]
    targets = [doc_target(sample.question) for sample in samples]
    by_form: dict[str, list[int]] = {}
    for position, sample in enumerate(samples):
        by_form.setdefault(form_of(sample.question), []).append(position)

    @cache
    def score_at(position: int, guess: str) -> float:
        return score(guess, samples[position].question.answers, "strict")

    def fit(out: frozenset[int]) -> dict[int, str]:
        # Of two folds that are held out, one is guessed as the other will be: without either.
        nested = {fold: [learned(out | {fold}) for learned in fits] for fold in set(folds) - out}
        everywhere = Counter(
            target for target, fold in zip(targets, folds, strict=True) if fold not in out
        )
        guesses: dict[int, str] = {}
        for of_form in by_form.values():
            known = [at for at in of_form if folds[at] not in out]
            constant = _commonest(Counter(targets[at] for at in known) or everywhere, everywhere)
            best = sum(score_at(at, constant) for at in known)
            chosen: Mapping[int, str] = dict.fromkeys(of_form, constant)
            for number, learned in enumerate(fits):
                total = sum(score_at(at, nested[folds[at]][number][at]) for at in known)
                if total > best:
                    best, chosen = total, learned(out)
            guesses |= {at: chosen[at] for at in of_form if folds[at] in out}
        return guesses

    return fit


_WORDS = Knowledge.WORDS
_NUMBER = Knowledge.NUMBER
_PLACE = Knowledge.PLACE
_CONSTANTS = (
    NamedGuesser(
        "one answer a file", Knowledge.FILE, partial(_guess_constant, group_of=lambda _: "")
    ),
    NamedGuesser(
        "one answer a form",
        _WORDS,
        partial(_guess_constant, group_of=lambda sample: form_of(sample.question)),
    ),
)
_FURTHER = (
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
GUESSERS = (*_CONSTANTS, *_FURTHER)


def facts_guesser(facts: Mapping[str, Sequence[ClueFacts]]) -> NamedGuesser:
    """Return the guesser that also knows facts of the clue frames, by id of the question."""
    return NamedGuesser(
        "learner: words, number, place, facts of the clues",
        _WORDS | _NUMBER | _PLACE | Knowledge.FACTS,
        partial(guess_by_learning, number=True, place=True, facts=facts),
    )


def blind_guesser(knowledge: Knowledge) -> NamedGuesser:
    """Return `blind`: of each form the best guesser that knows no more than that, or a constant."""
    guessers = [guesser for guesser in _FURTHER if guesser.knows in knowledge]
    return NamedGuesser("blind", knowledge, partial(_choose, guessers=guessers))
