"""What the published loop logs of a trajectory (`agent.log`): an action a row, running totals.

`total_reward` is set to the expert's at the beginning of each plan; `agent_reward` goes on from
plan to plan. The reward of an action that completes a plan enters neither, as the loop returns
before it adds it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from infthor_eval.plans.environment import Ended
from infthor_eval.plans.records import PlanRecord


@dataclass(frozen=True)
class LogRow:
    """One row: the state of the totals after an action.

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


def log_rows(plans: Sequence[PlanRecord]) -> Iterator[LogRow]:
    """Yield the rows of plans, in time order and run under the published rules, after `INIT`."""
    last = LogRow()
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
            yield LogRow(n_actions, total, agent_total, text, step.reward, plan.kind, plan.index)
        n_expert += plan.n_expert_steps
        expert_total += plan.expert_reward or 0.0
