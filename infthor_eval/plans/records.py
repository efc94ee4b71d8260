"""What plans write into a run's journal: each plan with everything that the agent did."""

import msgspec

from infthor_eval.episodes.records import EpisodeRecord
from infthor_eval.household.first_place import FirstPlace
from infthor_eval.plans.config import PlansConfig
from infthor_eval.quantities import Count, Number, Total
from infthor_eval.runs.journals.records import RecordTypes


class StepRecord(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One action of an agent.

    Attributes:
        reply: reply of the model; None for baselines.
        action: the action in words; empty if the reply could not be executed.
        call: call of the simulator, as JSON values; None if the reply could not be executed.
        message: what was wrong with it; empty if nothing was.
        n_context_tokens: tokens of the request; None if the model does not count.
    """

    reply: str | None = None
    action: str = ""
    call: dict[str, bool | Number | str | None] | None = None
    message: str = ""
    reward: Number = 0.0
    n_context_tokens: Count | None = None


class TwinRecord(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A plan of a final task that has a twin.

    Attributes:
        pair: id of the pair.
        base: hash of the trajectory that the pair was made of.
        finds: whether it is the plan that finds the object, the final task's first.
        first: place that the agent looked at first for it; None if it looked at none.
        n_opened: containers opened in which the object was not.
    """

    pair: str
    base: str
    finds: bool = False
    first: FirstPlace | None = None
    n_opened: Count = 0


class PlanRecord(
    EpisodeRecord, frozen=True, kw_only=True, omit_defaults=True, tag_field="type", tag="plan"
):
    """One plan, and what an agent did in it; `kind` as in `PlanKind`, `ended` as in `Ended`.

    A plan from imported counts (`infthor_eval.plans.published.imported_counts`) has its kind and
    whether it was done, no more: the goal is empty, and all numbers but its index are 0.

    Attributes:
        goal: goal of its task, in words.
        task: index of its task in the trajectory.
        first_step: index of the expert's first low-level action of it.
        n_expert_steps: number of the expert's actions.
        is_final: whether its task is the final long-horizon task.
        expert_reward: what the published loop adds to the expert's total with this plan; None under
            other rules.
        goal_reached: whether the task's goal was reached in it.
        conditions: conditions of the task's goal that were met at its end, and how many there are;
            None without a step.
        clue_distance: of a final task's plan, the frames from where its object, or the place that
            it goes to, was last in view to the task's first frame; None if it never was or that is
            not known.
        clue_tokens: the same in tokens of the whole history; None if the subject counts no tokens.
        twin: the pair of twins that it is of; None for others.
    """

    plan: str
    goal: str
    task: Count
    first_step: Count
    n_expert_steps: Count
    is_final: bool = False
    expert_reward: Number | None = None
    steps: tuple[StepRecord, ...] = ()
    goal_reached: bool = False
    conditions: tuple[Count, Total] | None = None
    clue_distance: Count | None = None
    clue_tokens: Count | None = None
    twin: TwinRecord | None = None


RECORDS = RecordTypes(unit=PlanRecord, config=PlansConfig)
