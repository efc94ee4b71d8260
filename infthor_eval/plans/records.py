"""What the suite of plans writes into a run's journal: plans, each with all that was done for it."""

import msgspec

from infthor_eval.runs.records import RecordTypes

__all__ = ["DONE", "NOT_ATTEMPTED", "RECORDS", "PlanRecord", "StepRecord"]

DONE, NOT_ATTEMPTED = "done", "not attempted"  # how a plan can end; see `environment.Ended`


class StepRecord(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One action of an agent.

    Attributes:
        reply: what a model said; None for baselines.
        action: the action in words; empty where the reply was none that could be tried.
        call: what the simulator was asked, as JSON values; None likewise.
        message: what was wrong with it; empty where nothing was.
        reward: what it earned.
        n_context_tokens: length of the request; None where the model does not tell.
    """

    reply: str | None = None
    action: str = ""
    call: dict[str, bool | float | str | None] | None = None
    message: str = ""
    reward: float = 0.0
    n_context_tokens: int | None = None


class PlanRecord(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, tag_field="type", tag="plan"):
    """One plan, and what an agent did for it.

    Attributes:
        index: its place among the trajectory's plans.
        kind: of the plan ("PickupObject").
        plan: in words.
        goal: of its task, in words.
        task: index of its task.
        is_final: whether that is the final long-horizon task.
        first_step: the expert's first low-level action of it.
        n_expert_steps: how many actions the expert took.
        steps: what the agent did; empty where the plan was not come to.
        reward: of all steps.
        max_reward: the most that the rules allow from its start; None where it was not come to.
        ended: how it ended ("done", "step limit", ...); "not come to" where an earlier plan ended the episode.
        goal_reached: whether the task's goal came to hold in it.
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
