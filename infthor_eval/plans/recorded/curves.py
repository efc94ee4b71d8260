"""Cumulative reward along trajectories of plans, from journals alone.

A trajectory's curve is a step function: at the end of each plan, in time order, it has the reward
of all plans so far.
"""

from collections.abc import Mapping, Sequence
from enum import StrEnum

from infthor_eval.episodes.curves import (
    Earned,
    Facet,
    Functions,
    RewardCurves,
    StepFunction,
    compute_curves,
)
from infthor_eval.episodes.records import NOT_ATTEMPTED
from infthor_eval.plans.recorded.runs import PlansRun, shared_plans
from infthor_eval.plans.records import PlanRecord
from infthor_eval.runs import UnitRecord


class Axis(StrEnum):
    """The x axis of a curve."""

    STEPS = "steps"
    TOKENS = "tokens"


FACETS: Mapping[str, Facet] = {
    Axis.STEPS: Facet(
        "expert's steps up to the end of the plan (low-level actions)", end_at="at step"
    ),
    Axis.TOKENS: Facet(
        "context of the plan's last request (tokens)",
        missing="context tokens are not reported",
        end_at="at context tokens",
        has_bound=False,
    ),
}


def plan_curves(runs: Sequence[PlansRun], task: str | None = None) -> RewardCurves:
    """Compute the curves of runs (at least one) of a task (None: the only one they share).

    See `compute_curves`. Plans that a run excludes are left out of all of them.
    """
    return compute_curves(runs, shared_plans(runs, task), FACETS, _functions, _count)


def _functions(trajectories: Sequence[Earned[PlanRecord]]) -> Functions:
    functions: dict[str, list[StepFunction]] = {
        Axis.STEPS: [_over_steps(units) for units in trajectories]
    }
    if any(_context(record) is not None for units in trajectories for record, _ in units):
        functions[Axis.TOKENS] = [_over_tokens(units) for units in trajectories]
    return functions


def _over_steps(units: Earned[PlanRecord]) -> StepFunction:
    plans = [(record.payload, reward) for record, reward in units]
    ends = [(plan.first_step + plan.n_expert_steps, reward) for plan, reward in plans]
    return StepFunction.of(ends, start=units[0][0].payload.first_step)


def _over_tokens(units: Earned[PlanRecord]) -> StepFunction:
    return StepFunction.of([(_context(record), reward) for record, reward in units])


def _context(record: UnitRecord[PlanRecord]) -> float | None:
    """Return the context tokens of the plan's last request; None if there are none or no count."""
    steps = record.payload.steps
    if record.tokens.context is not None or not steps:
        return record.tokens.context
    return steps[-1].n_context_tokens


def _count(plans: Sequence[UnitRecord[PlanRecord]]) -> dict[str, int]:
    return {
        "plans": len(plans),
        NOT_ATTEMPTED: sum(record.payload.ended == NOT_ATTEMPTED for record in plans),
    }
