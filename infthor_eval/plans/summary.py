"""Results of a run of plans: a pure function of its journal, without times."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from msgspec import UNSET, UnsetType

from infthor_eval.distances import DISTANCES, LENGTHS, distance_class, length_class
from infthor_eval.episodes.summary import (
    EpisodesSummary,
    EpisodeTaskSummary,
    answered_records,
    common_results,
    counted_records,
    success_rate,
    summarise_episodes,
)
from infthor_eval.facets import Facet
from infthor_eval.grouping import grouped
from infthor_eval.plans.config import PlansConfig, PlansTaskConfig
from infthor_eval.plans.environment import Ended
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.records import PlanRecord
from infthor_eval.plans.twins.results import TwinResults, twin_results
from infthor_eval.rates import Rate, clustered_rate, rate_over_clusters
from infthor_eval.runs import UnitRecord

Record = UnitRecord[PlanRecord]
_COLUMNS: dict[str, frozenset[str]] = {
    "Go to": frozenset({PlanKind.GOTO}),
    "Pick up": frozenset({PlanKind.PICKUP}),
    "Put": frozenset({PlanKind.PUT}),
    "total": frozenset(PlanKind),
}
NEVER = "not seen"  # class of plans whose clue was never in view, or is not known
FINAL_COLUMNS = tuple(_COLUMNS)  # of the paper's table of final tasks


@dataclass(frozen=True)
class _LogRow:
    """A row of the published log: the state of the totals after an action.

    Attributes:
        step: actions of the expert before the plan, and successful ones of the agent in it.
        total_reward: reward of the expert before the plan, and of these actions.
        agent_reward: reward of the agent in all plans.
        reward: reward of the action (`t_reward`).
        sub_goal: kind of the plan.
        plan: index of the plan (`high_idx`).
    """

    step: int = 0
    total_reward: float = 0.0
    agent_reward: float = 0.0
    action: str = "INIT"
    reward: float = 0.0
    sub_goal: str = "INIT"
    plan: int = 0


class PlanTaskSummary(EpisodeTaskSummary, frozen=True, kw_only=True):
    """Results of one task; those of rewards, goals and actions are None for imported counts.

    Attributes:
        n_plans: plans that count, with those that have no result.
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


def summarise_plans(
    config: PlansConfig,
    records: Sequence[Record],
    units_by_task: Mapping[str, int] = MappingProxyType({}),
) -> PlansSummary:
    """Summarise a run, given its config, its records, and the numbers of its tasks' plans."""
    return summarise_episodes(config, records, units_by_task, _summarise_task)


def _summarise_task(
    config: PlansTaskConfig, records: Sequence[Record], n_missing: int
) -> PlanTaskSummary:
    counted = counted_records(records)
    answered = answered_records(records)
    has_steps = config.rewards is not None  # which imported counts have not
    acted = answered if has_steps else []
    whole = _Whole(counted if has_steps else [])
    success = {name: _success(counted, kinds) for name, kinds in _COLUMNS.items()}
    success["total"] = success_rate(counted, n_missing)
    return PlanTaskSummary(
        **common_results(config, records, n_missing),
        n_plans=len(counted) + n_missing,
        n_tried=sum(record.payload.attempted for record in answered) if has_steps else None,
        success={name: rate for name, rate in success.items() if rate is not None},
        by_kind=_BY_KIND.means(counted, success_rate),
        path_weighted=_out_of(
            clustered_rate(
                [_path_weight(item.payload) for item in acted], [item.cluster for item in acted]
            ),
            len(counted) + n_missing,
        ),
        reward_share=whole.of_trajectories(lambda reward, most: reward / most if most else 0.0),
        reward=whole.of_trajectories(lambda reward, _: reward),
        max_reward=whole.of_trajectories(lambda _, most: most),
        goals=whole.goals(),
        goal_conditions=whole.goal_conditions(),
        by_distance=BY_DISTANCE.means(acted, success_rate),
        by_tokens=BY_TOKENS.means(acted, success_rate),
        n_actions=sum(len(record.payload.steps) for record in acted) if has_steps else None,
        rules=_rules(config.rewards),
        logged=_logged(whole.trajectories),
        twins=twin_results(records),
    )


def _rules(rewards: Mapping[str, Any] | None) -> str | None:
    """Return the name of reward rules as a run's config has them; runs of older versions do not say
    who scored."""
    return None if rewards is None else str(rewards.get("scoring", "older"))


def _logged(trajectories: Mapping[str, Sequence[PlanRecord]]) -> dict[str, Rate]:
    """Return the mean over trajectories of the last totals in the published log."""
    if not all(plan.expert_reward is not None for plans in trajectories.values() for plan in plans):
        return {}
    ends = [list(log_rows(plans))[-1] for _, plans in sorted(trajectories.items())]
    totals = {
        "total_reward": [end.total_reward for end in ends],
        "agent_reward": [end.agent_reward for end in ends],
    }
    return {
        name: rate
        for name, values in totals.items()
        if (rate := rate_over_clusters(values)) is not None
    }


def log_rows(plans: Sequence[PlanRecord]) -> Iterator[_LogRow]:
    """Yield what the published loop logs of a trajectory (`agent.log`), after `INIT`.

    `total_reward` is set to the expert's at the beginning of each plan; `agent_reward` goes on from
    plan to plan. The reward of an action that completes a plan enters neither, as the loop returns
    before it adds it.

    Args:
        plans: in time order, run under the published rules.
    """
    last = _LogRow()
    yield last
    n_expert = 0
    expert_total = 0.0
    agent_total = 0.0
    for plan in plans:
        n_actions = n_expert
        total = expert_total
        for number, step in enumerate(plan.steps, 1):
            # A failed action ends the plan and earns nothing; a completing one is left out.
            ends = number == len(plan.steps) and plan.ended != Ended.LIMIT
            if not ends:
                n_actions += 1
                total += step.reward
                agent_total += step.reward
            text = step.reply if step.reply is not None else step.action
            yield _LogRow(n_actions, total, agent_total, text, step.reward, plan.kind, plan.index)
        n_expert += plan.n_expert_steps
        expert_total += plan.expert_reward or 0.0


def _success(records: Sequence[Record], kinds: frozenset[str]) -> Rate | None:
    return success_rate([record for record in records if record.payload.kind in kinds])


def _path_weight(plan: PlanRecord) -> float:
    n_agent = max(plan.n_expert_steps, len(plan.steps))
    return plan.n_expert_steps / n_agent if plan.done and n_agent else 0.0


class _Whole:
    """Results of what takes several plans: tasks and trajectories of which all plans have one.

    A sum over the plans that happen to have a result would be a score of the server.
    """

    def __init__(self, records: Sequence[Record]) -> None:
        """Take the records that count."""
        self._records = records
        self._lost = [record for record in records if record.state != "answered"]

    @property
    def trajectories(self) -> dict[str, list[PlanRecord]]:
        """Plans of whole trajectories, in time order."""
        lost = {record.cluster for record in self._lost}
        whole = (record for record in self._records if record.cluster not in lost)
        return grouped((record.cluster, record.payload) for record in whole)

    def of_trajectories(self, measure: Callable[[float, float], float]) -> Rate | None:
        """Return the mean over trajectories of a measure of their reward and the highest one."""
        values = [
            measure(
                sum(plan.reward for plan in plans), sum(plan.max_reward or 0.0 for plan in plans)
            )
            for _, plans in sorted(self.trajectories.items())
        ]
        return _out_of(rate_over_clusters(values), len({it.cluster for it in self._records}))

    def goals(self) -> Rate | None:
        """Return the share of tasks whose goal was reached; those without a plan do not count."""
        reached: dict[tuple[str, int], float] = {}
        for record in self._of_whole_tasks:
            key = _task_of(record)
            reached[key] = float(bool(reached.get(key)) or record.payload.goal_reached)
        return self._of_tasks(reached)

    def goal_conditions(self) -> Rate | None:
        """Return the mean over tasks of the share of their conditions that are met where the agent
        left them."""
        last: dict[tuple[str, int], float] = {}
        for record in sorted(self._of_whole_tasks, key=lambda record: record.payload.index):
            if record.payload.conditions is not None:
                met, total = record.payload.conditions
                last[_task_of(record)] = met / total
        return self._of_tasks(last)

    @property
    def _of_whole_tasks(self) -> list[Record]:
        lost = set(map(_task_of, self._lost))
        return [record for record in self._records if _task_of(record) not in lost]

    def _of_tasks(self, values: Mapping[tuple[str, int], float]) -> Rate | None:
        rate = clustered_rate(list(values.values()), [trajectory for trajectory, _ in values])
        return _out_of(rate, len(values) + len(set(map(_task_of, self._lost))))


def _task_of(record: Record) -> tuple[str, int]:
    return record.cluster, record.payload.task


def _out_of(rate: Rate | None, n_all: int) -> Rate | None:
    return None if rate is None else rate.out_of(n_all)


def _distance(record: Record) -> str | None:
    plan = record.payload
    if not plan.is_final:
        return None
    return NEVER if plan.clue_distance is None else distance_class(plan.clue_distance)


def _clue_tokens(record: Record) -> str | None:
    tokens = record.payload.clue_tokens
    return None if tokens is None else length_class(tokens)


_BY_KIND = Facet[Record](
    "kind", "kind of plan", lambda record: record.payload.kind, tuple(map(str, PlanKind))
)
BY_DISTANCE = Facet(
    "distance", "frames since what they need was in view", _distance, (*DISTANCES, NEVER)
)
BY_TOKENS = Facet("tokens", "thousand tokens since then", _clue_tokens, LENGTHS)
