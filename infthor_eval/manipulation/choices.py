"""Results of arm twins: which of two things was taken, and which one the hand went to."""

from collections.abc import Callable, Sequence

import msgspec
from msgspec import UNSET, UnsetType

from infthor_eval.grouping import grouped
from infthor_eval.manipulation.records import ArmEnded, ArmRecord
from infthor_eval.pairs import Pairs, PairScore
from infthor_eval.rates import Rate
from infthor_eval.runs import UnitRecord

Record = UnitRecord[ArmRecord]


class ChoiceResults(msgspec.Struct, frozen=True):
    """Results of the pairs of a task; intervals are clustered by what pairs were made of.

    Attributes:
        n_pairs: pairs of which both worlds count.
        n_incomplete: pairs of which one does not, as it is excluded or has no result.
        net_pairs: pairs in which the thing that is named was taken in both worlds, less those in
            which the other one was: 0 on average for an arm that does not know the world.
        pair_accuracy: share of pairs in which it was taken in both.
        pairs_exchanged: share of pairs in which the other one was.
        chosen: net pairs by the thing that the hand took, or else was nearer to in the end.
    """

    n_pairs: int
    n_incomplete: int
    net_pairs: Rate | None = None
    pair_accuracy: Rate | None = None
    pairs_exchanged: Rate | None = None
    chosen: Rate | None = None


def choice_results(records: Sequence[Record]) -> ChoiceResults | UnsetType:
    """Return the results of a task's pairs; UNSET if its episodes are no choices."""
    by_pair = _by_pair(records)
    if not by_pair:
        return UNSET
    taken = _taken(by_pair)
    n_incomplete = len(by_pair) - len(taken.pairs)
    if not taken.pairs:
        return ChoiceResults(0, n_incomplete)
    n_all = len(by_pair)
    chosen = _pairs(
        by_pair,
        lambda record: record.payload.nears_other is False,
        lambda record: record.payload.nears_other is True,
    )
    return ChoiceResults(
        n_pairs=len(taken.pairs),
        n_incomplete=n_incomplete,
        **taken.rates(n_all),
        chosen=chosen.rates(n_all)["net_pairs"],
    )


def score_choices(records: Sequence[Record]) -> list[PairScore]:
    """Return the scores of the pairs of a task of which both worlds count."""
    taken = _taken(_by_pair(records))
    return taken.scores() if taken.pairs else []


def _by_pair(records: Sequence[Record]) -> dict[str, list[Record]]:
    """Return the records of choices by the name of their pair."""
    return grouped((record.payload.pair, record) for record in records if record.payload.pair)


def _taken(by_pair: dict[str, list[Record]]) -> Pairs[Record]:
    return _pairs(
        by_pair,
        lambda record: record.payload.done,
        lambda record: record.payload.ended == ArmEnded.OTHER,
    )


def _pairs(
    by_pair: dict[str, list[Record]],
    is_right: Callable[[Record], bool],
    is_exchanged: Callable[[Record], bool],
) -> Pairs[Record]:
    """Return the pairs of which both worlds have a result."""
    whole = [
        (both[0], both[1])
        for _, both in sorted(by_pair.items())
        if len(both) == 2 and all(record.state == "answered" for record in both)
    ]
    return Pairs(
        whole,
        name_of=lambda record: (record.payload.pair, "", ""),
        cluster_of=lambda record: record.payload.base,
        is_right=is_right,
        is_exchanged=is_exchanged,
    )
