"""What the suite of plans writes into a run's journal: plans, each with everything that the agent did."""

import msgspec

from infthor_eval.runs.records import RecordTypes

__all__ = ["DONE", "NOT_ATTEMPTED", "RECORDS", "PlanRecord", "StepRecord"]

DONE, NOT_ATTEMPTED = "done", "not attempted"  # how a plan can end; see `environment.Ended`


class StepRecord(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One action of an agent.

    Attributes:
        reply: reply of the model; None for baselines.
        action: the action in words; empty if the reply could not be executed.
        call: call of the simulator, as JSON values; None if the reply could not be executed.
        message: what was wrong with it; empty if nothing was.
        reward: reward of the action.
        n_context_tokens: tokens of the request; None if the model does not count.
    """

    reply: str | None = None
    action: str = ""
    call: dict[str, bool | float | str | None] | None = None
    message: str = ""
    reward: float = 0.0
    n_context_tokens: int | None = None


class PlanRecord(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, tag_field="type", tag="plan"):
    """One plan, and what an agent did in it.

    Attributes:
        index: place among the trajectory's plans.
        kind: kind of the plan ("PickupObject").
        plan: the plan in words.
        goal: goal of its task, in words.
        task: index of its task in the trajectory.
        first_step: index of the expert's first low-level action of it.
        n_expert_steps: number of the expert's actions.
        is_final: whether its task is the final long-horizon task.
        steps: actions of the agent; empty if the plan was not attempted.
        reward: reward of all steps.
        max_reward: highest possible reward from its start; None if it was not attempted.
        ended: how it ended ("done", "step limit", ...); "not attempted" if an earlier plan ended the trajectory; empty
            if the subject failed or the plan is excluded.
        goal_reached: whether the task's goal was reached in it.
    """

    index: int
    kind: str
    plan: str
    goal: str
    task: int
    first_step: int
    n_expert_steps: int
    is_final: bool = False
    steps: tuple[StepRecord, ...] = ()
    reward: float = 0.0
    max_reward: float | None = None
    ended: str = ""
    goal_reached: bool = False

    @property
    def attempted(self) -> bool:
        """Whether the agent acted in the plan."""
        return bool(self.steps)

    @property
    def done(self) -> bool:
        """Whether the plan was completed."""
        return self.ended == DONE


RECORDS = RecordTypes(unit=PlanRecord)
