"""Results of a run of manipulation: a pure function of its journal, without times."""

from collections.abc import Mapping, Sequence
from statistics import fmean
from types import MappingProxyType

from msgspec import UNSET, UnsetType

from infthor_eval.episodes.summary import (
    EpisodesSummary,
    EpisodeTaskSummary,
    answered_records,
    common_results,
    counted_records,
    success_rate,
    summarise_episodes,
)
from infthor_eval.manipulation.choices import ChoiceResults, choice_results
from infthor_eval.manipulation.config import ArmTaskConfig, ManipulationConfig
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.records import ArmEnded, ArmRecord
from infthor_eval.rates import Rate, clustered_rate
from infthor_eval.runs import UnitRecord

Record = UnitRecord[ArmRecord]


class ArmTaskSummary(EpisodeTaskSummary, frozen=True, kw_only=True):
    """Results of one task.

    Attributes:
        kind: "pickup" or "put".
        radius: radius of the hand's sphere, metres.
        success: share of successful episodes.
        released: share of puts whose object was released, wherever; None for pick-ups.
        at_rest: share of puts whose object then lies in or on its receptacle; likewise.
        inside: share of episodes whose object is in the sphere at the start: pick-ups without a
            movement.
        closest: smallest distance from the sphere's centre to the target, metres, mean over
            episodes.
        steps: steps of an episode, mean.
        collisions: collisions of an episode, mean.
        outcomes: success of each episode with a result by its id, 1 or 0; ids begin with the
            trajectory. Runs are paired by them.
        choices: results of arm twins; not written where there are none.
    """

    kind: str
    radius: float
    success: Rate | None
    released: Rate | None
    at_rest: Rate | None
    inside: Rate | None
    closest: float | None
    steps: float | None
    collisions: float | None
    outcomes: dict[str, float]
    choices: ChoiceResults | UnsetType = UNSET

    @property
    def n_episodes(self) -> int:
        """Number of episodes that count."""
        return (self.success.n if self.success else 0) + self.n_without


ManipulationSummary = EpisodesSummary[ArmTaskSummary]


def summarise_manipulation(
    config: ManipulationConfig,
    records: Sequence[Record],
    units_by_task: Mapping[str, int] = MappingProxyType({}),
) -> ManipulationSummary:
    """Summarise a run, given its config, its records, and the numbers of its tasks' episodes."""
    return summarise_episodes(config, records, units_by_task, _summarise_task)


def _summarise_task(
    config: ArmTaskConfig, records: Sequence[Record], n_missing: int
) -> ArmTaskSummary:
    acted = answered_records(records)
    counted = counted_records(records)
    puts = counted if config.kind == ManipulationKind.PUT else []
    starts_inside = [float(record.payload.starts_inside) for record in acted]
    return ArmTaskSummary(
        **common_results(config, records, n_missing),
        kind=config.kind,
        radius=config.radius,
        success=success_rate(counted, n_missing),
        released=success_rate(puts, n_missing, lambda put: put.released),
        at_rest=success_rate(puts, n_missing, lambda put: put.ended == ArmEnded.DONE),
        inside=clustered_rate(starts_inside, [record.cluster for record in acted]),
        closest=_mean([record.payload.closest for record in acted]),
        steps=_mean([len(record.payload.steps) for record in acted]),
        collisions=_mean([record.payload.n_collisions for record in acted]),
        outcomes={record.id: float(record.payload.done) for record in acted},
        choices=choice_results(records),
    )


def _mean(values: Sequence[float]) -> float | None:
    return fmean(values) if values else None
