"""Results of a run of plans: a pure function of its journal, without times."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from msgspec import UNSET, UnsetType

from infthor_eval.distances import DISTANCES, LENGTHS, distance_class, length_class
from infthor_eval.episodes.summary import (
    EpisodesSummary,
    EpisodeTaskSummary,
    common_results,
    counted_records,
    success_rate,
    summarise_episodes,
)
from infthor_eval.plans.config import PlansConfig, PlansTaskConfig
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.published.log import log_rows
from infthor_eval.plans.records import PlanRecord
from infthor_eval.plans.twins.results import TwinResults, twin_results
from infthor_eval.rates import Rate, clustered_rate, rate_over_clusters
from infthor_eval.runs import UnitRecord

__all__ = ["FINAL_COLUMNS", "NEVER", "PlanTaskSummary", "PlansSummary", "summarise_plans"]

Record = UnitRecord[PlanRecord]
_COLUMNS: dict[str, frozenset[str]] = {
    "Go to": frozenset({PlanKind.GOTO}),
    "Pick up": frozenset({PlanKind.PICKUP}),
    "Put": frozenset({PlanKind.PUT}),
    "total": frozenset(PlanKind),
}
NEVER = "not seen"  # class of plans whose clue was never in view, or is not known
FINAL_COLUMNS = tuple(_COLUMNS)  # of the paper's table of final tasks


class PlanTaskSummary(EpisodeTaskSummary, frozen=True, kw_only=True):
    """Results of one task; those of rewards, goals and actions are None for imported counts.

    Attributes:
        n_plans: plans that count; a failed one earns nothing.
        n_tried: those of them in which the subject acted.
        success: share of completed plans, by column of the published table.
        by_kind: share of completed plans, by kind.
        path_weighted: share of completed plans, each weighted by the expert's number of actions
            over the agent's where that is larger (ALFRED's path-weighted success).
        reward_share: reward of a trajectory divided by the highest possible reward of its attempted
            plans.
        reward: reward of a trajectory.
        max_reward: highest possible reward of a trajectory's attempted plans.
        goals: share of tasks whose goal was reached in one of their plans.
        goal_conditions: share of a task's goal conditions that are met at the end of its last plan
            that was tried (ALFRED's goal-condition success).
        by_distance: plans of final tasks done, by the frames since their clue was in view ("50-99",
            or `NEVER`).
        by_tokens: the same by thousand tokens of the history since then ("2-4").
        n_actions: actions of all plans.
        rules: name of the reward rules; None for imported counts.
        logged: totals of a trajectory as the published script logs them, by its names; empty under
            other rules.
        twins: results of pairs of twins; not written where there are none.
    """

    n_plans: int
    n_tried: int | None
    success: dict[str, Rate]
    by_kind: dict[str, Rate]
    path_weighted: Rate | None
    reward_share: Rate | None
    reward: Rate | None
    max_reward: Rate | None
    goals: Rate | None
    goal_conditions: Rate | None
    by_distance: dict[str, Rate]
    by_tokens: dict[str, Rate]
    n_actions: int | None
    rules: str | None
    logged: dict[str, Rate]
    twins: TwinResults | UnsetType = UNSET


PlansSummary = EpisodesSummary[PlanTaskSummary]


def summarise_plans(config: PlansConfig, records: Sequence[Record]) -> PlansSummary:
    """Summarise a run, given its config and the records of all its plans."""
    return summarise_episodes(config, records, _summarise_task)


def _summarise_task(config: PlansTaskConfig, records: Sequence[Record]) -> PlanTaskSummary:
    counted = counted_records(records)
    has_steps = config.rewards is not None  # which imported counts have not
    acted = counted if has_steps else []
    return PlanTaskSummary(
        **common_results(config, records),
        n_plans=len(counted),
        n_tried=sum(record.payload.attempted for record in counted) if has_steps else None,
        success={
            name: rate for name, kinds in _COLUMNS.items() if (rate := _success(counted, kinds))
        },
        by_kind={
            str(kind): rate for kind in PlanKind if (rate := _success(counted, frozenset({kind})))
        },
        path_weighted=clustered_rate(
            [_path_weight(item.payload) for item in acted], [item.cluster for item in acted]
        ),
        reward_share=_rate_of_trajectories(
            acted, lambda reward, most: reward / most if most else 0.0
        ),
        reward=_rate_of_trajectories(acted, lambda reward, _: reward),
        max_reward=_rate_of_trajectories(acted, lambda _, most: most),
        goals=_goals(acted),
        goal_conditions=_goal_conditions(acted),
        by_distance=_by_class(acted, _distance, (*DISTANCES, NEVER)),
        by_tokens=_by_class(acted, _clue_tokens, LENGTHS),
        n_actions=sum(len(record.payload.steps) for record in acted) if has_steps else None,
        rules=_rules(config.rewards),
        logged=_logged(acted),
        twins=twin_results(records),
    )


def _rules(rewards: Mapping[str, Any] | None) -> str | None:
    """Return the name of reward rules as a run's config has them; runs of older versions do not say
    who scored."""
    return None if rewards is None else str(rewards.get("scoring", "older"))


def _logged(records: Sequence[Record]) -> dict[str, Rate]:
    """Return the mean over trajectories of the last totals in the published log."""
    by_trajectory: dict[str, list[PlanRecord]] = {}
    for record in records:
        by_trajectory.setdefault(record.cluster, []).append(record.payload)
    if not all(
        plan.expert_reward is not None for plans in by_trajectory.values() for plan in plans
    ):
        return {}
    ends = [list(log_rows(plans))[-1] for _, plans in sorted(by_trajectory.items())]
    totals = {
        "total_reward": [end.total_reward for end in ends],
        "agent_reward": [end.agent_reward for end in ends],
    }
    return {
        name: rate
        for name, values in totals.items()
        if (rate := rate_over_clusters(values)) is not None
    }


def _success(records: Sequence[Record], kinds: frozenset[str]) -> Rate | None:
    return success_rate([record for record in records if record.payload.kind in kinds])


def _path_weight(plan: PlanRecord) -> float:
    n_agent = max(plan.n_expert_steps, len(plan.steps))
    return plan.n_expert_steps / n_agent if plan.done and n_agent else 0.0


def _goals(records: Sequence[Record]) -> Rate | None:
    """Return the share of tasks whose goal was reached; tasks without a plan here do not count."""
    reached: dict[tuple[str, int], bool] = {}
    for record in records:
        key = record.cluster, record.payload.task
        reached[key] = reached.get(key, False) or record.payload.goal_reached
    return clustered_rate(
        [float(value) for value in reached.values()], [trajectory for trajectory, _ in reached]
    )


def _goal_conditions(records: Sequence[Record]) -> Rate | None:
    """Return the mean over tasks of the share of their conditions that are met where the agent left
    them."""
    last: dict[tuple[str, int], float] = {}
    for record in sorted(records, key=lambda record: record.payload.index):
        if record.payload.conditions is not None:
            met, total = record.payload.conditions
            last[record.cluster, record.payload.task] = met / total
    return clustered_rate(list(last.values()), [trajectory for trajectory, _ in last])


def _by_class(
    records: Sequence[Record], class_of: Callable[[PlanRecord], str | None], names: Sequence[str]
) -> dict[str, Rate]:
    """Return the share of plans done in each class that has plans; some plans are in none."""
    groups: dict[str, list[Record]] = {}
    for record in records:
        name = class_of(record.payload)
        if name is not None:
            groups.setdefault(name, []).append(record)
    rates = {name: success_rate(groups[name]) for name in names if name in groups}
    return {name: rate for name, rate in rates.items() if rate is not None}


def _distance(plan: PlanRecord) -> str | None:
    if not plan.is_final:
        return None
    return NEVER if plan.clue_distance is None else distance_class(plan.clue_distance)


def _clue_tokens(plan: PlanRecord) -> str | None:
    return None if plan.clue_tokens is None else length_class(plan.clue_tokens)


def _rate_of_trajectories(
    records: Sequence[Record], measure: Callable[[float, float], float]
) -> Rate | None:
    """Return the mean over trajectories of a measure of their reward and highest possible
    reward."""
    sums: dict[str, tuple[float, float]] = {}
    for record in records:
        reward, most = sums.get(record.cluster, (0.0, 0.0))
        sums[record.cluster] = (
            reward + record.payload.reward,
            most + (record.payload.max_reward or 0.0),
        )
    return rate_over_clusters([measure(*sums[name]) for name in sorted(sums)])
