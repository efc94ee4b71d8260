"""Net pairs, the measure of twins in every suite: pairs right less pairs exchanged.

A pair is the same question, or task, in two worlds that differ in one thing. Who does not know
which world is which gives each world's answer to the other as often as to its own, whatever it
does: net pairs are 0 on average. Pairs right alone are not: whoever says something else in each
world, by a hash of the frames or because it was asked before, is both right and exchanged.
"""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean

from infthor_eval.rates import Rate, resampled_rate

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


def net_pairs(shares: Sequence[PairShares], clusters: Sequence[Hashable]) -> Rate | None:
    """Return the mean net score of pairs with its bootstrap interval; None without any."""
    return resampled_rate([pair.net for pair in shares], clusters)
