"""What a run of manipulation found: a pure function of its journal, without times."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from statistics import fmean
from typing import Any

import msgspec

from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.rates import Rate, clustered_rate
from infthor_eval.runs import UnitRecord

__all__ = ["ManipulationSummary", "TaskSummary", "summarise"]

Record = UnitRecord[ArmRecord]


class TaskSummary(msgspec.Struct, frozen=True):
    """One task.

    Attributes:
        kind: "pickup" or "put".
        radius: of the hand's sphere, metres.
        n_trajectories: that its episodes are of.
        n_failed: episodes on which the subject itself failed; they count as no success.
        excluded: episodes that do not count, by reason.
        skipped: trajectories that could not be read, by reason.
        success: share of episodes.
        inside: share of pick-ups whose object lies in the sphere at the start: what is had without moving.
        closest: metres from the middle of the sphere to the target, at its smallest, mean over episodes.
        steps: of an episode, mean.
        collisions: of an episode, mean.
        endings: how episodes ended, and how often.
    """

    kind: str
    radius: float
    n_trajectories: int
    n_failed: int
    excluded: dict[str, int]
    skipped: dict[str, int]
    success: Rate | None
    inside: Rate | None
    closest: float | None
    steps: float | None
    collisions: float | None
    endings: dict[str, int]


class ManipulationSummary(msgspec.Struct, frozen=True):
    """A run.

    Attributes:
        simulator: what its numbers were made in.
        tasks: by name.
    """

    simulator: str
    tasks: dict[str, TaskSummary]


def summarise(identity: Mapping[str, Any], records: Sequence[Record]) -> ManipulationSummary:
    """Sum up a run.

    Args:
        identity: of the run.
        records: of all its episodes.
    """
    kept = sorted(records, key=lambda record: record.key)
    tasks = identity["tasks"].items()
    found = {name: _task(about, [record for record in kept if record.task == name]) for name, about in tasks}
    return ManipulationSummary(str(identity["simulator"]), found)


def _task(about: Mapping[str, Any], records: Sequence[Record]) -> TaskSummary:
    counted = [record for record in records if record.excluded is None]
    acted = [record for record in counted if record.failure is None]

    def rate(values: Iterable[float], of: Sequence[Record]) -> Rate | None:
        return clustered_rate(list(values), [record.cluster for record in of])

    return TaskSummary(
        kind=about["kind"],
        radius=about["radius"],
        n_trajectories=len({record.cluster for record in counted}),
        n_failed=sum(record.failure is not None for record in counted),
        excluded=_counted(record.excluded for record in records if record.excluded is not None),
        skipped=_counted(reason for _, reason in about["broken"]),
        success=rate((float(record.payload.done) for record in counted), counted),
        inside=rate((float(record.payload.starts_inside) for record in acted), acted),
        closest=_mean(record.payload.closest for record in acted),
        steps=_mean(len(record.payload.steps) for record in acted),
        collisions=_mean(record.payload.n_collisions for record in acted),
        endings=_counted(record.payload.ended or "failed" for record in counted),
    )


def _mean(values: Iterable[float]) -> float | None:
    found = list(values)
    return fmean(found) if found else None


def _counted(items: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(items).items()))
