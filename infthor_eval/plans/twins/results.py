"""Results of pairs of twins: pairs with both worlds right, less those with both exchanged."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import msgspec
from msgspec import UNSET, UnsetType

from infthor_eval.household.first_place import FirstPlace
from infthor_eval.pairs import PairShares, net_pairs
from infthor_eval.plans.records import PlanRecord, TwinRecord
from infthor_eval.rates import Rate, clustered_rate, paired_rate
from infthor_eval.runs import UnitRecord

Record = UnitRecord[PlanRecord]
_World = tuple[Record, ...]  # the plans of one final task, in order; the first finds the object


class TwinResults(msgspec.Struct, frozen=True):
    """Results of the pairs of a task; intervals are clustered by what pairs were made of.

    Attributes:
        n_pairs: pairs of which both worlds count.
        n_incomplete: pairs of which one does not, as it is excluded or left out, or has no result.
        net_pairs: pairs right less pairs exchanged, -1 to 1, with the bootstrap interval of that
            difference: 0 on average for an agent that does not know which world is which.
        pair_accuracy: share of pairs in which the place looked at first is right in both worlds.
        pairs_exchanged: share of pairs in which it is in both worlds the place of the other one.
        pair_success: share of pairs whose final task was carried out in both worlds.
        accuracy: share of worlds in which the place looked at first is right.
        one_of_two: share of pairs in which it is right in one world alone.
        same_place: share of pairs in which the same place was looked at first in both worlds:
            whoever does not tell the worlds apart.
        nowhere: share of worlds in which no place was looked at.
        opened: containers opened in vain, mean over worlds.
        excess: actions more than the planner's until the object is found, mean over worlds in which
            it is.
    """

    n_pairs: int
    n_incomplete: int
    net_pairs: Rate | None
    pair_accuracy: Rate | None
    pairs_exchanged: Rate | None
    pair_success: Rate | None
    accuracy: Rate | None
    one_of_two: Rate | None
    same_place: Rate | None
    nowhere: Rate | None
    opened: Rate | None
    excess: Rate | None


def first_place_score(plan: PlanRecord) -> dict[str, float]:
    """Return the score of the place that was looked at first; none of plans that find nothing."""
    if plan.twin is None or not plan.twin.finds:
        return {}
    return {"first_place": float(plan.twin.first == FirstPlace.OWN)}


class PairScore(NamedTuple):
    """The score of a pair."""

    pair: str
    base: str
    shares: PairShares


def score_pairs(records: Sequence[Record]) -> list[PairScore]:
    """Return the scores of the pairs of a task of which both worlds count."""
    return [
        PairScore(_twin(one).pair, _base(one), _shares(one, other))
        for one, other in _whole_pairs(_worlds_of_pairs(records)[0])
    ]


def twin_results(records: Sequence[Record]) -> TwinResults | UnsetType:
    """Return the results of a task's pairs; UNSET if its trajectories are no twins."""
    pairs, lost = _worlds_of_pairs(records)
    if not pairs:
        return UNSET
    whole = _whole_pairs(pairs)
    return _Pairs(whole, len(whole) + len(lost)).results(len(pairs) - len(whole))


def _worlds_of_pairs(records: Sequence[Record]) -> tuple[dict[str, list[_World]], set[str]]:
    """Return the answered worlds of each pair, and the pairs of which a world has no result."""
    worlds: dict[str, list[Record]] = {}
    for record in sorted(records, key=lambda record: record.payload.index):
        if record.payload.twin is not None:
            worlds.setdefault(record.cluster, []).append(record)
    pairs: dict[str, list[_World]] = {}
    lost: set[str] = set()
    for world in worlds.values():
        group = pairs.setdefault(_twin(tuple(world)).pair, [])
        if all(record.state == "answered" for record in world):
            group.append(tuple(world))
        elif all(record.excluded is None for record in world):
            lost.add(_twin(tuple(world)).pair)
    return pairs, lost


def _whole_pairs(pairs: Mapping[str, Sequence[_World]]) -> list[tuple[_World, _World]]:
    return [(worlds[0], worlds[1]) for _, worlds in sorted(pairs.items()) if len(worlds) == 2]


class _Pairs:
    """Pairs of which both worlds count, of all those that were to be answered."""

    def __init__(self, pairs: Sequence[tuple[_World, _World]], n_all: int) -> None:
        self._pairs = pairs
        self._n_all = n_all

    def results(self, n_incomplete: int) -> TwinResults:
        return TwinResults(
            n_pairs=len(self._pairs),
            n_incomplete=n_incomplete,
            net_pairs=self._net_pairs(),
            pair_accuracy=self._share(_are_right),
            pairs_exchanged=self._share(_are_exchanged),
            pair_success=self._share(lambda one, other: _is_done(one) and _is_done(other)),
            accuracy=self._share_of_worlds(_is_right),
            one_of_two=self._share(lambda one, other: _is_right(one) != _is_right(other)),
            same_place=self._share(_went_to_the_same),
            nowhere=self._share_of_worlds(lambda world: _first(world) is None),
            opened=self._mean_opened(),
            excess=self._mean_excess(),
        )

    def _net_pairs(self) -> Rate | None:
        shares = [_shares(one, other) for one, other in self._pairs]
        rate = net_pairs(shares, [_base(one) for one, _ in self._pairs])
        return None if rate is None else rate.out_of(self._n_all)

    def _share(self, holds: Callable[[_World, _World], bool]) -> Rate | None:
        values = [float(holds(one, other)) for one, other in self._pairs]
        rate = clustered_rate(values, [_base(one) for one, _ in self._pairs])
        return None if rate is None else rate.out_of(self._n_all)

    def _share_of_worlds(self, holds: Callable[[_World], bool]) -> Rate | None:
        values = [float(holds(world)) for world in self._worlds]
        return clustered_rate(values, [_base(world) for world in self._worlds])

    def _mean_opened(self) -> Rate | None:
        counts = [float(_twin(world).n_opened) for world in self._worlds]
        # Differences from 0: counts are no shares, also where none is above 1.
        return paired_rate([0.0] * len(counts), counts, [_base(world) for world in self._worlds])

    def _mean_excess(self) -> Rate | None:
        found = [world for world in self._worlds if world[0].payload.done]
        own = [float(len(world[0].payload.steps)) for world in found]
        expert = [float(world[0].payload.n_expert_steps) for world in found]
        return paired_rate(expert, own, [_base(world) for world in found])

    @property
    def _worlds(self) -> list[_World]:
        return [world for pair in self._pairs for world in pair]


def _twin(world: _World) -> TwinRecord:
    twin = world[0].payload.twin
    assert twin is not None
    return twin


def _base(world: _World) -> str:
    return _twin(world).base


def _first(world: _World) -> FirstPlace | None:
    return _twin(world).first


def _is_right(world: _World) -> bool:
    return _first(world) == FirstPlace.OWN


def _are_right(one: _World, other: _World) -> bool:
    return _is_right(one) and _is_right(other)


def _are_exchanged(one: _World, other: _World) -> bool:
    return _first(one) == _first(other) == FirstPlace.TWIN


def _shares(one: _World, other: _World) -> PairShares:
    return PairShares(float(_are_right(one, other)), float(_are_exchanged(one, other)))


def _is_done(world: _World) -> bool:
    return all(record.payload.done for record in world)


def _went_to_the_same(one: _World, other: _World) -> bool:
    """Return True if one of the two places was looked at first in both worlds."""
    return {_first(one), _first(other)} == {FirstPlace.OWN, FirstPlace.TWIN}
