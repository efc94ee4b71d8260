"""Results of pairs of twins: pairs with both worlds right, less those with both exchanged."""

from collections.abc import Mapping, Sequence

import msgspec
from msgspec import UNSET, UnsetType

from infthor_eval.household.first_place import FirstPlace
from infthor_eval.pairs import Pairs, PairScore
from infthor_eval.plans.records import PlanRecord, TwinRecord
from infthor_eval.rates import Rate, paired_rate
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
    net_pairs: Rate | None = None
    pair_accuracy: Rate | None = None
    pairs_exchanged: Rate | None = None
    pair_success: Rate | None = None
    accuracy: Rate | None = None
    one_of_two: Rate | None = None
    same_place: Rate | None = None
    nowhere: Rate | None = None
    opened: Rate | None = None
    excess: Rate | None = None


def first_place_score(plan: PlanRecord) -> dict[str, float]:
    """Return the score of the place that was looked at first; none of plans that find nothing."""
    if plan.twin is None or not plan.twin.finds:
        return {}
    return {"first_place": float(plan.twin.first == FirstPlace.OWN)}


def score_pairs(records: Sequence[Record]) -> list[PairScore]:
    """Return the scores of the pairs of a task of which both worlds count."""
    return _pairs(_worlds_of_pairs(records)[0]).scores()


def twin_results(records: Sequence[Record]) -> TwinResults | UnsetType:
    """Return the results of a task's pairs; UNSET if its trajectories are no twins."""
    worlds, lost = _worlds_of_pairs(records)
    if not worlds:
        return UNSET
    whole = _pairs(worlds)
    n_pairs = len(whole.pairs)
    n_incomplete = len(worlds) - n_pairs
    if not n_pairs:
        return TwinResults(n_pairs, n_incomplete)
    n_all = n_pairs + len(lost)
    return TwinResults(
        n_pairs=n_pairs,
        n_incomplete=n_incomplete,
        **whole.rates(n_all),
        pair_success=whole.mean(lambda one, other: _is_done(one) and _is_done(other)).out_of(n_all),
        accuracy=whole.mean_of_worlds(_is_right),
        one_of_two=whole.mean(whole.is_one_right).out_of(n_all),
        same_place=whole.mean(_went_to_the_same).out_of(n_all),
        nowhere=whole.mean_of_worlds(lambda world: _first(world) is None),
        opened=_mean_opened(whole.worlds),
        excess=_mean_excess(whole.worlds),
    )


def _pairs(worlds: Mapping[str, Sequence[_World]]) -> Pairs[_World]:
    """Return the pairs of which both worlds count."""
    return Pairs(
        [(both[0], both[1]) for _, both in sorted(worlds.items()) if len(both) == 2],
        name_of=lambda world: (_twin(world).pair, "", ""),
        cluster_of=_base,
        is_right=_is_right,
        is_exchanged=lambda world: _first(world) == FirstPlace.TWIN,
    )


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


def _mean_opened(worlds: Sequence[_World]) -> Rate | None:
    counts = [float(_twin(world).n_opened) for world in worlds]
    # Differences from 0: counts are no shares, also where none is above 1.
    return paired_rate([0.0] * len(counts), counts, list(map(_base, worlds)))


def _mean_excess(worlds: Sequence[_World]) -> Rate | None:
    found = [world for world in worlds if world[0].payload.done]
    own = [float(len(world[0].payload.steps)) for world in found]
    expert = [float(world[0].payload.n_expert_steps) for world in found]
    return paired_rate(expert, own, list(map(_base, found)))


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


def _is_done(world: _World) -> bool:
    return all(record.payload.done for record in world)


def _went_to_the_same(one: _World, other: _World) -> bool:
    """Return True if one of the two places was looked at first in both worlds."""
    return {_first(one), _first(other)} == {FirstPlace.OWN, FirstPlace.TWIN}
