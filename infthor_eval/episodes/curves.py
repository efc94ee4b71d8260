"""How reward adds up along trajectories: step functions of single ones, and their mean with an interval over them.

It knows no suite: each says what a record earns, where it stands in its trajectory, and which runs can be drawn
together.
"""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from infthor_eval.statistics import MeanEstimate, mean_over_clusters

__all__ = ["AT_MOST", "Curve", "Facet", "RewardCurves", "RunCurves", "StepFunction", "grid_of", "mean_curve"]

AT_MOST = "at most"  # the name of the bound where no planner is among the runs
_FINEST = 400  # points of a grid; a picture shows no more


@dataclass(frozen=True)
class StepFunction:
    """Reward so far in one trajectory: 0 before the first place, from each place on its value.

    Attributes:
        places: where it steps, ascending; several units may end in one place.
        values: from each place on.
    """

    places: tuple[float, ...]
    values: tuple[float, ...]

    @classmethod
    def of(cls, units: Sequence[tuple[float | None, float]], start: float | None = None) -> "StepFunction":
        """The curve of units in time order.

        Args:
            units: where each ends, None where nobody knows, and its reward. One that would lie before an earlier one
                stands where that does (a context that was cut is shorter than one before it); so does one whose place
                is unknown.
            start: where the first unit begins, with nothing earned; None leaves that out.
        """
        found = units if start is None else [(start, 0.0), *units]
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
    means: tuple[MeanEstimate, ...]

    @property
    def end(self) -> MeanEstimate:
        """Where it ends."""
        return self.means[-1]


@dataclass(frozen=True)
class Facet:
    """One of the ways in which runs are drawn: over what, or which of their units. A picture has a column for each.

    Attributes:
        over: what reward is drawn over, in words.
        title: above the column; empty where `over` says it all.
        untold: what stands where no run has such a curve.
        end_at: head of the table's column of where curves end; None for none.
        earned: head of the table's column of what curves end with; None for none.
    """

    over: str
    title: str = ""
    untold: str = ""
    end_at: str | None = None
    earned: str | None = None


@dataclass(frozen=True)
class RunCurves:
    """One run.

    Attributes:
        label: what it is called.
        is_bound: whether it is what the others are held against: a planner, or the most that can be earned.
        is_embedded: whether its numbers are of the embedded simulator alone.
        curves: by the names of facets that its records tell of; at least by that of the first one.
        counts: of units that are drawn, and of those that earn nothing for a reason; by what they are called.
    """

    label: str
    is_bound: bool
    is_embedded: bool
    curves: Mapping[str, Curve]
    counts: Mapping[str, int]


@dataclass(frozen=True)
class RewardCurves:
    """Several runs on the same trajectories.

    Attributes:
        task: the task, or the tasks.
        facets: by name; the first one is what the table is about.
        runs: in the order given; the bound last, so that it is drawn on top.
        n_trajectories: that every curve is the mean over.
        notes: what must be said with them, a line each.
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


def grid_of(runs: Sequence[Sequence[StepFunction]]) -> np.ndarray:
    """All places where a function of a run steps, or where these are many, evenly spaced ones."""
    places = np.unique([place for functions in runs for item in functions for place in item.places])
    return places if len(places) <= _FINEST else np.linspace(places[0], places[-1], _FINEST)


def mean_curve(functions: Sequence[StepFunction], grid: np.ndarray) -> Curve:
    """The mean of a run's functions, one of each trajectory, up to where the longest ends.

    At each point of the grid stands the mean of the last values; a trajectory that is shorter keeps its end value, so
    that the end of a curve is the mean reward of whole trajectories.
    """
    last = max(item.places[-1] for item in functions)
    places = tuple(float(place) for place in grid if place <= last)
    return Curve(places, tuple(mean_over_clusters([item.at(place) for item in functions]) for place in places))
