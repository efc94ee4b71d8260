"""How reward adds up along trajectories: curves of several runs of plans, from their journals alone.

A trajectory's curve is a step function: at the end of each plan, in time order, stands the reward of all plans so far.
The curve of a run is the mean over trajectories, the same ones for all runs, with an interval over them.
"""

from collections.abc import Iterable, Mapping, Sequence
from enum import StrEnum

import numpy as np

from infthor_eval.episodes.curves import (
    AT_MOST,
    Curve,
    Facet,
    RewardCurves,
    RunCurves,
    StepFunction,
    grid_of,
    mean_curve,
)
from infthor_eval.plans.curve_runs import PlansRun, SharedPlans, shared_plans
from infthor_eval.plans.records import NOT_COME_TO, PlanRecord
from infthor_eval.runs import UnitRecord

__all__ = ["FACETS", "Axis", "reward_curves"]

Record = UnitRecord[PlanRecord]


class Axis(StrEnum):
    """What reward is drawn over."""

    STEPS = "steps"
    TOKENS = "tokens"


FACETS: Mapping[str, Facet] = {
    Axis.STEPS: Facet("expert's steps up to the end of the plan (low-level actions)", end_at="at step"),
    Axis.TOKENS: Facet(
        "context of the plan's last request (tokens)",
        untold="context tokens are not told",
        end_at="at context tokens",
    ),
}


def reward_curves(runs: Sequence[PlansRun], task: str | None = None) -> RewardCurves:
    """The curves of some runs, on the trajectories and plans that all of them have.

    At each point of a common grid stands the mean over trajectories of the last value; a trajectory that is shorter
    keeps its end value, so that the end of a curve is the mean reward of whole trajectories. The interval is a t
    interval over trajectories. Plans that a run excludes are left out of all of them.

    Args:
        runs: at least one.
        task: which task of theirs; None takes the one that they share.

    Raises:
        UsageError: they share no task or several, or their rewards follow different rules.
        DataError: they share no trajectory, or a journal is not what it should be.
    """
    shared = shared_plans(runs, task)
    functions = [_functions_of_run(records) for records in shared.records]
    grids: dict[str, np.ndarray] = {
        axis: grid_of([found[axis] for found in functions if axis in found]) for axis in Axis
    }
    drawn = [
        _run_curves(run, records, {axis: mean_curve(found[axis], grids[axis]) for axis in found})
        for run, records, found in zip(runs, shared.records, functions, strict=True)
    ]
    notes = [*shared.notes, *_token_notes(drawn)]
    if not any(run.is_bound for run in drawn):
        drawn.append(_most_allowed(runs, shared, grids[Axis.STEPS]))
        notes += _unknown_notes(shared)
    return RewardCurves(
        task=shared.task,
        facets=FACETS,
        runs=tuple(sorted(drawn, key=lambda run: run.is_bound)),
        n_trajectories=len(shared.trajectories),
        notes=tuple(notes),
    )


def _functions_of_run(trajectories: Sequence[Sequence[Record]]) -> dict[str, list[StepFunction]]:
    """A function per trajectory, by axis."""
    found: dict[str, list[StepFunction]] = {}
    found[Axis.STEPS] = [_over_steps(records, map(_earned, records)) for records in trajectories]
    if any(_context(record) is not None for records in trajectories for record in records):
        found[Axis.TOKENS] = [StepFunction.of([(_context(r), _earned(r)) for r in records]) for records in trajectories]
    return found


def _over_steps(records: Sequence[Record], rewards: Iterable[float]) -> StepFunction:
    ends = (record.payload.first_step + record.payload.n_expert_steps for record in records)
    return StepFunction.of(list(zip(ends, rewards, strict=True)), start=records[0].payload.first_step)


def _context(record: Record) -> float | None:
    """Context tokens of the plan's last request; None where the model does not tell, or was not asked."""
    steps = record.payload.steps
    return record.tokens.context if record.tokens.context is not None or not steps else steps[-1].n_context_tokens


def _earned(record: Record) -> float:
    return 0.0 if record.failure is not None else record.payload.reward


def _run_curves(run: PlansRun, records: Sequence[Sequence[Record]], curves: Mapping[str, Curve]) -> RunCurves:
    plans = [record for trajectory in records for record in trajectory]
    return RunCurves(
        label=run.label,
        is_bound=run.is_planner,
        is_embedded=run.about.is_embedded,
        curves=curves,
        counts=_counts(
            len(plans),
            sum(record.failure is not None for record in plans),
            sum(record.payload.ended == NOT_COME_TO for record in plans),
        ),
    )


def _counts(n_plans: int, n_failed: int = 0, n_not_come_to: int = 0) -> dict[str, int]:
    return {"plans": n_plans, "failed": n_failed, "not come to": n_not_come_to}


def _most_allowed(runs: Sequence[PlansRun], shared: SharedPlans, grid: np.ndarray) -> RunCurves:
    """The most that the rules allow, as the runs recorded it; of a plan that none of them came to, nothing."""
    functions = []
    for of_runs in zip(*shared.records, strict=True):  # one trajectory, as each run has it
        most = [max(r.payload.max_reward or 0.0 for r in same) for same in zip(*of_runs, strict=True)]
        functions.append(_over_steps(of_runs[0], most))
    return RunCurves(
        label=AT_MOST,
        is_bound=True,
        is_embedded=all(run.about.is_embedded for run in runs),
        curves={Axis.STEPS: mean_curve(functions, grid)},
        counts=_counts(sum(map(len, shared.records[0]))),
    )


def _token_notes(runs: Sequence[RunCurves]) -> list[str]:
    untold = [run.label for run in runs if Axis.TOKENS not in run.curves]
    return [f"no curve over context tokens, which are not told: {', '.join(untold)}"] if untold else []


def _unknown_notes(shared: SharedPlans) -> list[str]:
    """Plans by which the bound is too low."""
    plans = [same for of_runs in zip(*shared.records, strict=True) for same in zip(*of_runs, strict=True)]
    unknown = sum(all(record.payload.max_reward is None for record in same) for same in plans)
    return [f"plans that no run came to, which add nothing to {AT_MOST!r}: {unknown}"] if unknown else []
