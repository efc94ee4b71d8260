"""How reward adds up along trajectories: curves of several runs of plans, from their journals alone.

A trajectory's curve is a step function: at the end of each plan, in time order, stands the reward of all plans so far.
The curve of a run is the mean over trajectories, the same ones for all runs, with an interval over them.
"""

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import accumulate

import numpy as np

from infthor_eval.agents.curve_runs import PlansRun, SharedPlans, shared_plans
from infthor_eval.agents.records import NOT_COME_TO, PlanRecord
from infthor_eval.runs import UnitRecord
from infthor_eval.statistics import Estimate, mean_over_clusters

__all__ = ["AT_MOST", "Axis", "Curve", "RewardCurves", "RunCurves", "StepFunction", "reward_curves"]

AT_MOST = "at most"  # the name of the bound where no planner is among the runs
_FINEST = 400  # points of a grid; a picture shows no more

Record = UnitRecord[PlanRecord]


class Axis(StrEnum):
    """What reward is drawn over."""

    STEPS = "steps"
    TOKENS = "tokens"


@dataclass(frozen=True)
class StepFunction:
    """Reward so far in one trajectory: 0 before the first place, from each place on its value.

    Attributes:
        places: where it steps, ascending; several plans may end in one place.
        values: from each place on.
    """

    places: tuple[float, ...]
    values: tuple[float, ...]

    @classmethod
    def of(cls, plans: Sequence[tuple[float | None, float]], start: float | None = None) -> "StepFunction":
        """The curve of plans in time order.

        Args:
            plans: where each ends, None where nobody knows, and its reward. A plan that would lie before an earlier one
                stands where that does (a context that was cut is shorter than one before it); so does one whose place
                is unknown.
            start: where the first plan begins, with nothing earned; None leaves that out.
        """
        found = plans if start is None else [(start, 0.0), *plans]
        first = next((place for place, _ in found if place is not None), 0.0)
        places = accumulate((first if place is None else place for place, _ in found), max)
        return cls(tuple(places), tuple(accumulate(reward for _, reward in found)))

    def at(self, place: float) -> float:
        """The value there."""
        number = bisect_right(self.places, place)
        return self.values[number - 1] if number else 0.0


@dataclass(frozen=True)
class Curve:
    """Mean over trajectories of reward so far.

    Attributes:
        places: points of the grid that all runs share, up to this run's last one.
        means: at each, with the 95 % interval over trajectories.
    """

    places: tuple[float, ...]
    means: tuple[Estimate, ...]

    @property
    def end(self) -> Estimate:
        """Where it ends."""
        return self.means[-1]


@dataclass(frozen=True)
class RunCurves:
    """One run.

    Attributes:
        label: what it is called.
        is_bound: whether it is what the others are held against: the planner, or the most that the rules allow.
        is_embedded: whether its numbers are of the embedded simulator alone.
        curves: over each axis that its records tell of; a model that counts no tokens has none over them.
        n_plans: that are drawn.
        n_failed: of those, plans on which the subject failed; they earn nothing.
        n_not_come_to: of those, plans that an earlier one's failure kept it from; they earn nothing.
    """

    label: str
    is_bound: bool
    is_embedded: bool
    curves: Mapping[Axis, Curve]
    n_plans: int
    n_failed: int = 0
    n_not_come_to: int = 0


@dataclass(frozen=True)
class RewardCurves:
    """Several runs on one task.

    Attributes:
        task: the task.
        runs: in the order given; the bound last, so that it is drawn on top.
        n_trajectories: that every curve is the mean over.
        notes: what must be said with them, a line each.
    """

    task: str
    runs: tuple[RunCurves, ...]
    n_trajectories: int
    notes: tuple[str, ...]


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
    grids = {axis: _grid([found[axis] for found in functions if axis in found]) for axis in Axis}
    drawn = [
        _run_curves(run, records, {axis: _curve(found[axis], grids[axis]) for axis in found})
        for run, records, found in zip(runs, shared.records, functions, strict=True)
    ]
    notes = [*shared.notes, *_token_notes(drawn)]
    if not any(run.is_bound for run in drawn):
        drawn.append(_most_allowed(runs, shared, grids[Axis.STEPS]))
        notes += _unknown_notes(shared)
    return RewardCurves(
        task=shared.task,
        runs=tuple(sorted(drawn, key=lambda run: run.is_bound)),
        n_trajectories=len(shared.trajectories),
        notes=tuple(notes),
    )


def _functions_of_run(trajectories: Sequence[Sequence[Record]]) -> dict[Axis, list[StepFunction]]:
    """A function per trajectory, by axis."""
    found = {Axis.STEPS: [_over_steps(records, map(_earned, records)) for records in trajectories]}
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


def _grid(runs: Sequence[Sequence[StepFunction]]) -> np.ndarray:
    """All places where a function of a run steps, or where these are many, evenly spaced ones."""
    places = np.unique([place for functions in runs for item in functions for place in item.places])
    return places if len(places) <= _FINEST else np.linspace(places[0], places[-1], _FINEST)


def _curve(functions: Sequence[StepFunction], grid: np.ndarray) -> Curve:
    last = max(item.places[-1] for item in functions)
    places = tuple(float(place) for place in grid if place <= last)
    return Curve(places, tuple(mean_over_clusters([item.at(place) for item in functions]) for place in places))


def _run_curves(run: PlansRun, records: Sequence[Sequence[Record]], curves: Mapping[Axis, Curve]) -> RunCurves:
    plans = [record for trajectory in records for record in trajectory]
    return RunCurves(
        label=run.label,
        is_bound=run.about.is_planner,
        is_embedded=run.about.is_embedded,
        curves=curves,
        n_plans=len(plans),
        n_failed=sum(record.failure is not None for record in plans),
        n_not_come_to=sum(record.payload.ended == NOT_COME_TO for record in plans),
    )


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
        curves={Axis.STEPS: _curve(functions, grid)},
        n_plans=sum(map(len, shared.records[0])),
    )


def _token_notes(runs: Sequence[RunCurves]) -> list[str]:
    untold = [run.label for run in runs if Axis.TOKENS not in run.curves]
    return [f"no curve over context tokens, which are not told: {', '.join(untold)}"] if untold else []


def _unknown_notes(shared: SharedPlans) -> list[str]:
    """Plans by which the bound is too low."""
    plans = [same for of_runs in zip(*shared.records, strict=True) for same in zip(*of_runs, strict=True)]
    unknown = sum(all(record.payload.max_reward is None for record in same) for same in plans)
    return [f"plans that no run came to, which add nothing to {AT_MOST!r}: {unknown}"] if unknown else []
