"""Results of a run of episodes: a pure function of its journal, without times."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Generic, TypeVar

import msgspec

from infthor_eval.episodes.config import EpisodesConfig, EpisodeTaskConfig
from infthor_eval.episodes.records import EpisodeRecord
from infthor_eval.rates import Rate, clustered_rate
from infthor_eval.runs import UnitRecord


class EpisodeTaskSummary(msgspec.Struct, frozen=True, kw_only=True):
    """Results of one task, as far as plans and arms have them alike.

    Attributes:
        n_trajectories: trajectories of the episodes that count.
        n_failed: episodes in which the subject itself failed, which have no result.
        excluded: episodes that do not count, by reason.
        skipped: trajectories that could not be read, by reason.
        endings: number of episodes by how they ended.
        n_not_asked: episodes that a stopped run did not come to, or that a cap left out.
    """

    n_trajectories: int
    n_failed: int
    excluded: dict[str, int]
    skipped: dict[str, int]
    endings: dict[str, int]
    n_not_asked: int = 0

    @property
    def n_without(self) -> int:
        """Number of episodes that count and have no result."""
        return self.n_failed + self.n_not_asked


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
    units_by_task: Mapping[str, int],
    summarise_task: Callable[[C, list[UnitRecord[P]], int], T],
) -> EpisodesSummary[T]:
    """Summarise a run.

    Args:
        units_by_task: see `RunHeader`.
        summarise_task: returns a task's results, given its config, its records in order, and the
            number of its episodes without a record.
    """
    ordered = sorted(records, key=lambda record: record.key)
    tasks = {}
    for name, task in config.tasks.items():
        chosen = [record for record in ordered if record.task == name]
        n_missing = max(0, units_by_task.get(name, 0) - len(chosen))
        tasks[name] = summarise_task(task, chosen, n_missing)
    return EpisodesSummary(config.simulator, tasks)


def counted_records(records: Sequence[UnitRecord[P]]) -> list[UnitRecord[P]]:
    """Return the records that count: those that are not excluded."""
    return [record for record in records if record.excluded is None]


def answered_records(records: Sequence[UnitRecord[P]]) -> list[UnitRecord[P]]:
    """Return the records with a result, which scores are over."""
    return [record for record in records if record.state == "answered"]


def common_results(
    config: EpisodeTaskConfig, records: Sequence[UnitRecord[P]], n_missing: int
) -> dict[str, Any]:
    """Return the fields of `EpisodeTaskSummary`; see `summarise_episodes`."""
    counted = counted_records(records)
    states = Counter(record.state for record in counted)
    return {
        "n_trajectories": len({record.cluster for record in counted}),
        "n_failed": states["failed"],
        "n_not_asked": states["not asked"] + n_missing,
        "excluded": _count(record.excluded for record in records if record.excluded is not None),
        "skipped": _count(reason for _, reason in config.broken),
        "endings": _count(
            record.payload.ended if record.state == "answered" else record.state
            for record in counted
        ),
    }


def success_rate(
    records: Sequence[UnitRecord[P]],
    n_missing: int = 0,
    succeeds: Callable[[P], bool] = lambda payload: payload.done,
) -> Rate | None:
    """Return the share of successes among results, clustered by trajectory; None without any.

    Args:
        records: records that count.
        n_missing: number of further episodes that count.
        succeeds: whether an episode is a success.
    """
    answered = answered_records(records)
    rate = clustered_rate(
        [float(succeeds(record.payload)) for record in answered],
        [record.cluster for record in answered],
    )
    return None if rate is None else rate.out_of(len(records) + n_missing)


def _count(reasons: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(reasons).items()))
