"""Cumulative reward along trajectories: step functions of single trajectories, and their mean over trajectories."""

from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np

from infthor_eval.episodes.recorded_runs import RecordedRun
from infthor_eval.episodes.records import P
from infthor_eval.episodes.shared_units import SharedUnits
from infthor_eval.runs.records import UnitRecord
from infthor_eval.statistics import MeanEstimate, mean_over_clusters

__all__ = [
    "AT_MOST",
    "Curve",
    "Earned",
    "Facet",
    "Functions",
    "RewardCurves",
    "RunCurves",
    "StepFunction",
    "compute_curves",
]

AT_MOST = "at most"  # label of the bound if no planner is among the runs
_MAX_POINTS = 400  # of a grid; a picture resolves no more


@dataclass(frozen=True)
class StepFunction:
    """Cumulative reward in one trajectory: 0 before the first place, and constant from each place to the next.

    Attributes:
        places: places of the steps, ascending; several episodes may end in one place.
        values: value from each place on.
    """

    places: tuple[float, ...]
    values: tuple[float, ...]

    @classmethod
    def of(cls, units: Sequence[tuple[float | None, float]], start: float | None = None) -> "StepFunction":
        """Sum up the rewards of episodes in time order.

        Args:
            units: place where each episode ends (None if unknown) and its reward. An unknown place, or one before an
                earlier episode's, becomes the earlier one's: a context that was truncated is shorter than the last.
            start: place where the first episode begins, with nothing earned; None leaves it out.
        """
        points = units if start is None else [(start, 0.0), *units]
        first = next((place for place, _ in points if place is not None), 0.0)
        places = accumulate((first if place is None else place for place, _ in points), max)
        return cls(tuple(places), tuple(accumulate(reward for _, reward in points)))

    def at(self, place: float) -> float:
        """Return the value at a place."""
        number = bisect_right(self.places, place)
        return self.values[number - 1] if number else 0.0


@dataclass(frozen=True)
class Curve:
    """Mean over trajectories of the cumulative reward.

    Attributes:
        places: points of the grid that all runs share, up to this run's last one.
        means: mean at each point, with its 95 % interval over trajectories.
    """

    places: tuple[float, ...]
    means: tuple[MeanEstimate, ...]

    @property
    def end(self) -> MeanEstimate:
        """The last mean."""
        return self.means[-1]


@dataclass(frozen=True)
class Facet:
    """One panel column of the picture: an x axis, or a kind of episode.

    Attributes:
        over: label of the x axis.
        title: heading of the column; empty if `over` suffices.
        missing: text in a panel if no run has such a curve.
        end_at: heading of the table's column with the place where curves end; None for no such column.
        earned: heading of the table's column with the last mean; None for no such column.
        has_bound: whether the highest possible reward has a place on this axis.
    """

    over: str
    title: str = ""
    missing: str = ""
    end_at: str | None = None
    earned: str | None = None
    has_bound: bool = True


@dataclass(frozen=True)
class RunCurves:
    """The curves of one run.

    Attributes:
        is_bound: whether it is the upper bound: a planner, or the highest possible reward.
        is_embedded: whether its numbers are from the embedded simulator alone.
        curves: curves by facet; the first facet is always there.
        counts: number of episodes, and of those that earn nothing for a reason, by description.
    """

    label: str
    is_bound: bool
    is_embedded: bool
    curves: Mapping[str, Curve]
    counts: Mapping[str, int]


@dataclass(frozen=True)
class RewardCurves:
    """The curves of several runs on the same trajectories.

    Attributes:
        facets: facets by name; the table is about the first one.
        runs: runs in the order given; the bound is last, so that it is drawn on top.
        n_trajectories: trajectories that every curve is the mean of.
    """

    task: str
    facets: Mapping[str, Facet]
    runs: tuple[RunCurves, ...]
    n_trajectories: int
    notes: tuple[str, ...]

    @property
    def main(self) -> str:
        """Name of the first facet."""
        return next(iter(self.facets))


Earned = Sequence[tuple[UnitRecord[P], float]]  # the episodes of a trajectory in time order, and their rewards
Functions = Mapping[str, Sequence[StepFunction]]  # by facet, one of each trajectory


def compute_curves(
    runs: Sequence[RecordedRun[P, Any]],
    shared: SharedUnits[P],
    facets: Mapping[str, Facet],
    functions_of: Callable[[Sequence[Earned[P]]], Functions],
    count: Callable[[Sequence[UnitRecord[P]]], dict[str, int]],
) -> RewardCurves:
    """Compute the curves of some runs, and an upper bound.

    At each point of a common grid stands the mean over trajectories of the last value. A trajectory that is shorter
    keeps its last value, so the end of a curve is the mean reward of whole trajectories. Failed episodes earn nothing.

    There is exactly one bound: the planner among the runs if there is one, else the highest possible reward. Several
    planners (of other settings) are runs like the others, as none of them bounds them all.

    Args:
        functions_of: returns the step functions of a run's trajectories, by facet.
        count: returns the counts of some episodes by description, the number of all first.
    """
    functions = [
        functions_of([[(r, 0.0 if r.failure is not None else r.payload.reward) for r in records] for records in run])
        for run in shared.records
    ]
    grids = {name: _grid([by_facet[name] for by_facet in functions if name in by_facet]) for name in facets}
    planners = [run for run in runs if run.is_planner]
    bound = planners[0] if len(planners) == 1 else None
    drawn = [
        RunCurves(
            label=run.label,
            is_bound=run is bound,
            is_embedded=run.is_embedded,
            curves={name: _mean_curve(of_facet, grids[name]) for name, of_facet in by_facet.items()},
            counts=count([record for trajectory in records for record in trajectory]),
        )
        for run, records, by_facet in zip(runs, shared.records, functions, strict=True)
    ]
    notes = [*shared.notes, *_missing_notes(drawn, facets)]
    if bound is None:
        most = [list(_highest_rewards(records)) for records in zip(*shared.records, strict=True)]
        by_facet = functions_of([[(record, reward or 0.0) for record, reward in units] for units in most])
        drawn.append(
            RunCurves(
                label=AT_MOST,
                is_bound=True,
                is_embedded=all(run.is_embedded for run in runs),
                curves={name: _mean_curve(by_facet[name], grids[name]) for name in facets if facets[name].has_bound},
                counts={what: n if number == 0 else 0 for number, (what, n) in enumerate(drawn[0].counts.items())},
            )
        )
        if n_unknown := sum(reward is None for units in most for _, reward in units):
            what = next(iter(drawn[0].counts))
            notes.append(f"{what} that no run attempted, which add nothing to {AT_MOST!r}: {n_unknown}")
    return RewardCurves(
        task=" and ".join(shared.tasks),
        facets=facets,
        runs=tuple(sorted(drawn, key=lambda run: run.is_bound)),
        n_trajectories=len(shared.trajectories),
        notes=tuple(notes),
    )


def _highest_rewards(of_runs: Sequence[Sequence[UnitRecord[P]]]) -> Iterator[tuple[UnitRecord[P], float | None]]:
    """Yield the episodes of a trajectory with the highest possible reward that any run recorded; None if none did."""
    for same in zip(*of_runs, strict=True):
        recorded = [record.payload.max_reward for record in same if record.payload.max_reward is not None]
        yield same[0], max(recorded, default=None)


def _missing_notes(runs: Sequence[RunCurves], facets: Mapping[str, Facet]) -> Iterator[str]:
    for name, facet in facets.items():
        if missing := [run.label for run in runs if name not in run.curves]:
            yield f"{facet.missing}: {', '.join(missing)}"


def _grid(runs: Sequence[Sequence[StepFunction]]) -> np.ndarray:
    """Return all places where a function of a run steps, or evenly spaced ones if these are too many."""
    places = np.unique([place for functions in runs for item in functions for place in item.places])
    return places if len(places) <= _MAX_POINTS else np.linspace(places[0], places[-1], _MAX_POINTS)


def _mean_curve(functions: Sequence[StepFunction], grid: np.ndarray) -> Curve:
    """Return the mean of a run's functions, one of each trajectory, up to the end of the longest."""
    last = max(item.places[-1] for item in functions)
    places = tuple(float(place) for place in grid if place <= last)
    return Curve(places, tuple(mean_over_clusters([item.at(place) for item in functions]) for place in places))
