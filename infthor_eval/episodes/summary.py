"""Results of a run of episodes: a pure function of its journal, without times."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Generic, TypeVar

import msgspec

from infthor_eval.episodes.config import EpisodesConfig, EpisodeTaskConfig
from infthor_eval.episodes.records import EpisodeRecord
from infthor_eval.rates import Rate, clustered_rate
from infthor_eval.runs import UnitRecord

__all__ = [
    "EpisodeTaskSummary",
    "EpisodesSummary",
    "common_results",
    "counted_records",
    "success_rate",
    "summarise_episodes",
]


class EpisodeTaskSummary(msgspec.Struct, frozen=True, kw_only=True):
    """Results of one task, as far as plans and arms have them alike.

    Attributes:
        n_trajectories: trajectories of the episodes that count.
        n_failed: episodes in which the subject itself failed; they count as no success.
        excluded: episodes that do not count, by reason.
        skipped: trajectories that could not be read, by reason.
        endings: number of episodes by how they ended.
    """

    n_trajectories: int
    n_failed: int
    excluded: dict[str, int]
    skipped: dict[str, int]
    endings: dict[str, int]


C = TypeVar("C", bound=EpisodeTaskConfig)
P = TypeVar("P", bound=EpisodeRecord)
T = TypeVar("T", bound=EpisodeTaskSummary)


class EpisodesSummary(msgspec.Struct, Generic[T], frozen=True):
    """Results of a run."""

    simulator: str
    tasks: dict[str, T]


def summarise_episodes(
    config: EpisodesConfig[C],
    records: Sequence[UnitRecord[P]],
    summarise_task: Callable[[C, list[UnitRecord[P]]], T],
) -> EpisodesSummary[T]:
    """Summarise a run.

    Args:
        summarise_task: returns a task's results, given its config and its records in order.
    """
    ordered = sorted(records, key=lambda record: record.key)
    tasks = {}
    for name, task in config.tasks.items():
        chosen = [record for record in ordered if record.task == name]
        tasks[name] = summarise_task(task, chosen)
    return EpisodesSummary(config.simulator, tasks)


def counted_records(records: Sequence[UnitRecord[P]]) -> list[UnitRecord[P]]:
    """Return the records that count: those that are not excluded."""
    return [record for record in records if record.excluded is None]


def common_results(config: EpisodeTaskConfig, records: Sequence[UnitRecord[P]]) -> dict[str, Any]:
    """Return the fields of `EpisodeTaskSummary`, given a task's config and its records."""
    counted = counted_records(records)
    return {
        "n_trajectories": len({record.cluster for record in counted}),
        "n_failed": sum(record.failure is not None for record in counted),
        "excluded": _count(record.excluded for record in records if record.excluded is not None),
        "skipped": _count(reason for _, reason in config.broken),
        "endings": _count(record.payload.ended or "failed" for record in counted),
    }


def success_rate(records: Sequence[UnitRecord[P]]) -> Rate | None:
    """Return the share of successes, clustered by trajectory; None if there are no records."""
    return clustered_rate(
        [float(record.payload.done) for record in records], [record.cluster for record in records]
    )


def _count(reasons: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(reasons).items()))
