"""What a run of plans found: a pure function of its journal, without times."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import msgspec

from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.records import PlanRecord
from infthor_eval.rates import Rate, clustered_rate, rate_over_clusters
from infthor_eval.runs import UnitRecord

__all__ = ["FINAL_COLUMNS", "PlansSummary", "TaskSummary", "summarise"]

Record = UnitRecord[PlanRecord]
_COLUMNS: dict[str, frozenset[str]] = {
    "Go to": frozenset({PlanKind.GOTO}),
    "Pick up": frozenset({PlanKind.PICKUP}),
    "Put": frozenset({PlanKind.PUT}),
    "total": frozenset(PlanKind),
}
FINAL_COLUMNS = tuple(_COLUMNS)  # of the paper's table of final tasks


class TaskSummary(msgspec.Struct, frozen=True):
    """One task.

    Attributes:
        n_plans: plans that count; a failed one counts as earning nothing.
        n_trajectories: that they are of.
        n_failed: plans on which the subject itself failed.
        excluded: plans that do not count, by reason; the expert's own action is refused here.
        skipped: trajectories that could not be read.
        success: share of plans carried out, by column of the published table.
        by_kind: the same by kind of plan.
        reward_share: of a trajectory, reward by the most that the rules allow for the plans that were come to.
        reward: of a trajectory.
        max_reward: of a trajectory, the most that the rules allow for the plans that were come to.
        goals: share of tasks whose goal came to hold in one of their plans.
        endings: how plans ended, and how often.
        n_actions: all that the subject asked for.
    """

    n_plans: int
    n_trajectories: int
    n_failed: int
    excluded: dict[str, int]
    skipped: dict[str, int]
    success: dict[str, Rate]
    by_kind: dict[str, Rate]
    reward_share: Rate | None
    reward: Rate | None
    max_reward: Rate | None
    goals: Rate | None
    endings: dict[str, int]
    n_actions: int


class PlansSummary(msgspec.Struct, frozen=True):
    """A run.

    Attributes:
        simulator: what its numbers were made in.
        tasks: by name.
    """

    simulator: str
    tasks: dict[str, TaskSummary]


def summarise(identity: Mapping[str, Any], records: Sequence[Record]) -> PlansSummary:
    """Sum up a run.

    Args:
        identity: of the run.
        records: of all its plans.
    """
    kept = sorted(records, key=lambda record: record.key)
    tasks = identity["tasks"].items()
    found = {name: _task(about, [record for record in kept if record.task == name]) for name, about in tasks}
    return PlansSummary(str(identity["simulator"]), found)


def _task(settings: Mapping[str, Any], records: Sequence[Record]) -> TaskSummary:
    counted = [record for record in records if record.excluded is None]
    return TaskSummary(
        n_plans=len(counted),
        n_trajectories=len({record.cluster for record in counted}),
        n_failed=sum(record.failure is not None for record in counted),
        excluded=_counted(record.excluded for record in records if record.excluded is not None),
        skipped=_counted(reason for _, reason in settings["broken"]),
        success={name: rate for name, kinds in _COLUMNS.items() if (rate := _success(counted, kinds))},
        by_kind={str(kind): rate for kind in PlanKind if (rate := _success(counted, frozenset({kind})))},
        reward_share=_of_trajectories(counted, lambda got, most: got / most if most else 0.0),
        reward=_of_trajectories(counted, lambda got, _: got),
        max_reward=_of_trajectories(counted, lambda _, most: most),
        goals=_goals(counted),
        endings=_counted(record.payload.ended or "failed" for record in counted),
        n_actions=sum(len(record.payload.steps) for record in counted),
    )


def _counted(items: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(items).items()))


def _success(records: Sequence[Record], kinds: frozenset[str]) -> Rate | None:
    chosen = [record for record in records if record.payload.kind in kinds]
    return clustered_rate([float(record.payload.done) for record in chosen], [record.cluster for record in chosen])


def _goals(records: Sequence[Record]) -> Rate | None:
    """A task that has no plan here is none."""
    reached: dict[tuple[str, int], bool] = {}
    for record in records:
        key = record.cluster, record.payload.task
        reached[key] = reached.get(key, False) or record.payload.goal_reached
    return clustered_rate([float(value) for value in reached.values()], [trajectory for trajectory, _ in reached])


def _of_trajectories(records: Sequence[Record], measure: Callable[[float, float], float]) -> Rate | None:
    sums: dict[str, tuple[float, float]] = {}
    for record in records:
        got, most = sums.get(record.cluster, (0.0, 0.0))
        sums[record.cluster] = got + record.payload.reward, most + (record.payload.max_reward or 0.0)
    return rate_over_clusters([measure(*sums[name]) for name in sorted(sums)])
