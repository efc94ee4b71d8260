"""Pairs of twins in every suite, and net pairs, their measure: pairs right less pairs exchanged.

A pair is the same question, or task, in two worlds that differ in one thing. Who does not know
which world is which gives each world's answer to the other as often as to its own, whatever it
does: net pairs are 0 on average. Pairs right alone are not: whoever says something else in each
world, by a hash of the frames or because it was asked before, is both right and exchanged.
"""

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from statistics import fmean
from typing import Generic, NamedTuple, TypeVar

from infthor_eval.rates import Rate, clustered_rate, resampled_rate

W = TypeVar("W")  # how a world of a pair was answered

PAIR_BOUNDS: Mapping[str, tuple[float, float]] = {
    "net_pairs": (-1.0, 1.0),
    "pair_accuracy": (0.0, 1.0),
    "pairs_exchanged": (0.0, 1.0),
}
"""Least and greatest value of each metric of pairs, the primary one first."""


@dataclass(frozen=True)
class PairShares:
    """The shares of a pair's repetitions in which both worlds are right, and both exchanged."""

    right: float
    exchanged: float

    @classmethod
    def mean(cls, shares: Iterable["PairShares"]) -> "PairShares":
        """Return the means of some shares, at least one."""
        rights, exchanged = zip(*((it.right, it.exchanged) for it in shares), strict=True)
        return cls(fmean(rights), fmean(exchanged))

    @property
    def net(self) -> float:
        """Net score, -1 to 1."""
        return self.right - self.exchanged

    @property
    def by_metric(self) -> dict[str, float]:
        """The scores by metric, as in `PAIR_BOUNDS`."""
        return dict(zip(PAIR_BOUNDS, (self.net, self.right, self.exchanged), strict=True))


class PairScore(NamedTuple):
    """The score of a pair over its repetitions.

    Attributes:
        pair: name of the pair.
        variant: name of the variant in which it was asked; empty if there is one alone.
        fact: name of what differs between the worlds, which several pairs may be about.
        cluster: name of what both worlds were made of.
        shares: the shares of its repetitions.
    """

    pair: str
    variant: str
    fact: str
    cluster: str
    shares: PairShares


@dataclass(frozen=True)
class Pairs(Generic[W]):
    """Answered pairs, at least one; intervals are clustered by what their worlds were made of.

    Attributes:
        pairs: the two worlds of each pair, in each repetition; those of a pair follow one another.
        name_of: returns the names of a world's pair, variant and fact (`PairScore`).
        cluster_of: returns the name of what a world was made of.
        is_right: returns whether a world's answer is right.
        is_exchanged: returns whether it is right in the other world.
    """

    pairs: Sequence[tuple[W, W]]
    name_of: Callable[[W], tuple[str, str, str]]
    cluster_of: Callable[[W], str]
    is_right: Callable[[W], bool]
    is_exchanged: Callable[[W], bool]

    @property
    def worlds(self) -> list[W]:
        """The worlds of all pairs."""
        return [world for pair in self.pairs for world in pair]

    def scores(self) -> list[PairScore]:
        """Return the score of each pair in each variant, over its repetitions."""
        scores = []
        for name, same in groupby(self.pairs, key=lambda pair: self.name_of(pair[0])):
            pairs = list(same)
            shares = PairShares.mean(map(self.shares, pairs))
            scores.append(PairScore(*name, self.cluster_of(pairs[0][0]), shares))
        return scores

    def rates(self, n_all: int) -> dict[str, Rate]:
        """Return the means of pairs, of `n_all` that were to be answered, by metric."""
        scores = self.scores()
        clusters = [it.cluster for it in scores]
        rates = {
            "net_pairs": net_pairs([it.shares for it in scores], clusters),
            "pair_accuracy": _mean([it.shares.right for it in scores], clusters),
            "pairs_exchanged": _mean([it.shares.exchanged for it in scores], clusters),
        }
        return {name: rate.out_of(n_all) for name, rate in rates.items()}

    def net(self, pairs: Sequence[tuple[W, W]]) -> Rate:
        """Return the net pairs of some of them, each repetition by itself."""
        return net_pairs(list(map(self.shares, pairs)), self._clusters(pairs))

    def mean(self, value: Callable[[W, W], float], of: Sequence[tuple[W, W]] | None = None) -> Rate:
        """Return the mean of a value of both worlds, over the pairs or some of them."""
        pairs = self.pairs if of is None else of
        return _mean([float(value(*pair)) for pair in pairs], self._clusters(pairs))

    def mean_of_worlds(self, value: Callable[[W], float]) -> Rate:
        """Return the mean of a value of a single world."""
        values = [float(value(world)) for world in self.worlds]
        return _mean(values, list(map(self.cluster_of, self.worlds)))

    def are_right(self, one: W, other: W) -> bool:
        """Return whether the answers in both worlds of a pair are right."""
        return self.is_right(one) and self.is_right(other)

    def is_one_right(self, one: W, other: W) -> bool:
        """Return whether the answer in just one of both worlds is."""
        return self.is_right(one) != self.is_right(other)

    def shares(self, pair: tuple[W, W]) -> PairShares:
        """Return whether both worlds of a pair are right, and whether both are exchanged."""
        are_exchanged = all(map(self.is_exchanged, pair))
        return PairShares(float(self.are_right(*pair)), float(are_exchanged))

    def _clusters(self, pairs: Sequence[tuple[W, W]]) -> list[str]:
        return [self.cluster_of(one) for one, _ in pairs]


def net_pairs(shares: Sequence[PairShares], clusters: Sequence[Hashable]) -> Rate:
    """Return the mean net score of pairs, at least one, with its bootstrap interval."""
    return _known(resampled_rate([pair.net for pair in shares], clusters))


def _mean(values: Sequence[float], clusters: Sequence[Hashable]) -> Rate:
    return _known(clustered_rate(values, clusters))


def _known(rate: Rate | None) -> Rate:
    assert rate is not None  # there are values
    return rate
