"""Guessers without frames: each guesses the questions of a file from other trajectories."""

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Flag, auto
from functools import partial

from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.chains import (
    Chain,
    Guesser,
    HoldOut,
    chains_of_words,
    chains_of_words_and_count,
    chains_of_words_and_place,
    form_of,
    held_out,
)
from infthor_eval.nieh.guessing.clue_facts import ClueFacts
from infthor_eval.nieh.guessing.learner import guess_by_learning

__all__ = ["GUESSERS", "Knowledge", "NamedGuesser", "facts_guesser"]


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
        rule: how it guesses samples from those that are not held out with them.
    """

    name: str
    knows: Knowledge
    rule: Callable[[Sequence[Sample], HoldOut], list[str]]

    def guess(self, samples: Sequence[Sample], hold_out: HoldOut | None = None) -> list[str]:
        """Return a guess for each sample of a file (on the clue frames); an empty text for none.

        A sample is guessed without those that are held out with it; by default see `held_out`.
        """
        return self.rule(samples, hold_out or held_out(samples))


def _guess_constant(
    samples: Sequence[Sample], own_of: HoldOut, group_of: Callable[[Sample], str]
) -> list[str]:
    """Guess the commonest answer of a group on other trajectories; of equals the first by name."""
    everywhere: dict[str, Counter[str]] = defaultdict(Counter)
    own: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
    for sample in samples:
        group = group_of(sample)
        answer = doc_target(sample.question)
        everywhere[group][answer] += 1
        own[group, own_of(sample)][answer] += 1
    guesses = []
    for sample in samples:
        group = group_of(sample)
        counts = everywhere[group] - own[group, own_of(sample)]
        guesses.append(min(counts, key=lambda answer: (-counts[answer], answer), default=""))
    return guesses


def _guess_by_chains(
    samples: Sequence[Sample], hold_out: HoldOut, chains: Callable[[Sample], list[Chain]]
) -> list[str]:
    guesser = Guesser(samples, chains, hold_out)
    return [guesser.guess(sample) for sample in samples]


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
    NamedGuesser("words (blind)", _WORDS, partial(_guess_by_chains, chains=chains_of_words)),
    NamedGuesser(
        "words, number of frames (blind-count)",
        _WORDS | _NUMBER,
        partial(_guess_by_chains, chains=chains_of_words_and_count),
    ),
    NamedGuesser(
        "words, place of the clues",
        _WORDS | _PLACE,
        partial(_guess_by_chains, chains=chains_of_words_and_place),
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
