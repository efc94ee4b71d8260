"""Cumulative reward along trajectories: step functions of single ones, and their mean."""

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import accumulate
from typing import Any, Generic, TypeVar

import numpy as np

from infthor_eval.episodes.recorded_runs import RecordedRun
from infthor_eval.episodes.records import EpisodeRecord
from infthor_eval.episodes.shared_units import SharedUnits
from infthor_eval.runs.journals.records import UnitRecord
from infthor_eval.statistics import MeanEstimate, mean_over_clusters

P = TypeVar("P", bound=EpisodeRecord)
AT_MOST = "at most"  # label of the bound if no planner is among the runs
_MAX_POINTS = 400  # of a grid; a picture resolves no more


@dataclass(frozen=True)
class StepFunction:
    """Cumulative reward in one trajectory: 0 before the first place, then constant between them.

    Attributes:
        places: places of the steps, ascending; several episodes may end in one place.
        values: value from each place on.
    """

    places: tuple[float, ...]
    values: tuple[float, ...]

    @classmethod
    def of(
        cls, units: Sequence[tuple[float | None, float]], start: float | None = None
    ) -> "StepFunction":
        """Sum up the rewards of episodes in time order.

        Args:
            units: place where each episode ends (None if unknown) and its reward. An unknown place,
                or one before an earlier episode's, becomes the earlier one's: a context that was
                truncated is shorter than the last.
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
        end_at: heading of the table's column with the place where curves end; None for no such
            column.
        earned: heading of the table's column with the last mean; None for no such column.
        has_bound: whether the highest possible reward has places of its own on this axis; else runs
            lend it theirs.
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


# The episodes of a trajectory in time order, and their rewards.
Earned = Sequence[tuple[UnitRecord[P], float]]
Functions = Mapping[str, Sequence[StepFunction]]  # by facet, one of each trajectory


@dataclass(frozen=True)
class _Drawn(Generic[P]):
    """A run, or the highest possible reward, before its mean over trajectories is taken."""

    label: str
    is_embedded: bool
    earned: Sequence[Earned[P]]
    functions: Functions
    counts: Mapping[str, int]

    def curves(self, grids: Mapping[str, np.ndarray], *, is_bound: bool) -> RunCurves:
        means = {
            facet: _mean_curve(functions, grids[facet])
            for facet, functions in self.functions.items()
        }
        return RunCurves(self.label, is_bound, self.is_embedded, means, self.counts)


def compute_curves(
    runs: Sequence[RecordedRun[P, Any]],
    shared: SharedUnits[P],
    facets: Mapping[str, Facet],
    functions_of: Callable[[Sequence[Earned[P]]], Functions],
    count: Callable[[Sequence[UnitRecord[P]]], dict[str, int]],
) -> RewardCurves:
    """Compute the curves of some runs, and an upper bound.

    At each point of a common grid stands the mean over trajectories of the last value. A trajectory
    that is shorter keeps its last value, so the end of a curve is the mean reward of whole
    trajectories. Failed episodes earn nothing.

    There is exactly one bound: the planner among the runs if there is one, else the highest
    possible reward. Several planners (of other settings) are runs like the others, as none of them
    bounds them all. In a facet where the bound has no places, each of its episodes stands at the
    first place that a run has for it.

    Args:
        functions_of: returns the step functions of a run's trajectories, by facet.
        count: returns the counts of some episodes by description, the number of all first.
    """
    drawn = [
        _drawn_run(run, trajectories, functions_of, count)
        for run, trajectories in zip(runs, shared.records, strict=True)
    ]
    notes = list(shared.notes)
    planners = [number for number, run in enumerate(runs) if run.is_planner]
    if len(planners) == 1:
        bound = drawn.pop(planners[0])
    else:
        bound, n_unknown = _highest_possible(drawn, shared.records, facets, functions_of)
        if n_unknown:
            what = next(iter(bound.counts))
            notes.append(
                f"{what} that no run attempted, which add nothing to {AT_MOST!r}: {n_unknown}"
            )
    facets_of_runs = {name for run in drawn for name in run.functions}
    lent = [name for name in facets if name in facets_of_runs - bound.functions.keys()]
    if lent:
        bound = _on_lent_places(bound, lent, shared.records, functions_of)
        notes += _lent_notes(bound, [facets[name] for name in lent])
    everything = [*drawn, bound]
    notes += _missing_notes(everything if len(planners) == 1 else drawn, facets)
    grids = {name: _grid(name, everything) for name in facets}
    return RewardCurves(
        task=" and ".join(shared.tasks),
        facets=facets,
        runs=tuple(run.curves(grids, is_bound=run is bound) for run in everything),
        n_trajectories=len(shared.trajectories),
        notes=tuple(notes),
    )


def _drawn_run(
    run: RecordedRun[P, Any],
    trajectories: Sequence[Sequence[UnitRecord[P]]],
    functions_of: Callable[[Sequence[Earned[P]]], Functions],
    count: Callable[[Sequence[UnitRecord[P]]], dict[str, int]],
) -> _Drawn[P]:
    earned = [_earned(records) for records in trajectories]
    counts = count([record for records in trajectories for record in records])
    return _Drawn(run.label, run.is_embedded, earned, functions_of(earned), counts)


def _earned(records: Sequence[UnitRecord[P]]) -> Earned[P]:
    """Pair episodes with their rewards."""
    return [(record, record.payload.reward) for record in records]


def _highest_possible(
    drawn: Sequence[_Drawn[P]],
    records: Sequence[Sequence[Sequence[UnitRecord[P]]]],
    facets: Mapping[str, Facet],
    functions_of: Callable[[Sequence[Earned[P]]], Functions],
) -> tuple[_Drawn[P], int]:
    """Return the highest possible reward, and the number of episodes that no run has it for."""
    earned: list[Earned[P]] = []
    n_unknown = 0
    for same_trajectory in zip(*records, strict=True):
        most = list(_highest_rewards(same_trajectory))
        earned.append([(record, reward or 0.0) for record, reward in most])
        n_unknown += sum(reward is None for _, reward in most)
    functions = {
        facet: of_facet
        for facet, of_facet in functions_of(earned).items()
        if facets[facet].has_bound
    }
    n_episodes, *rest = drawn[0].counts.items()
    counts = dict([n_episodes, *((what, 0) for what, _ in rest)])
    is_embedded = all(run.is_embedded for run in drawn)
    return _Drawn(AT_MOST, is_embedded, earned, functions, counts), n_unknown


def _on_lent_places(
    bound: _Drawn[P],
    lent: Sequence[str],
    records: Sequence[Sequence[Sequence[UnitRecord[P]]]],
    functions_of: Callable[[Sequence[Earned[P]]], Functions],
) -> _Drawn[P]:
    """Add facets in which the bound's episodes stand where the first of the runs has them."""

    def place(facet: str, record: UnitRecord[P]) -> float:
        alone = functions_of([[(record, 0.0)]])
        return alone[facet][0].places[-1] if facet in alone else math.inf

    functions = dict(bound.functions)
    for facet in lent:
        earned = []
        for same_trajectory, of_bound in zip(zip(*records, strict=True), bound.earned, strict=True):
            same_episodes = zip(*same_trajectory, strict=True)
            first = [min(episodes, key=partial(place, facet)) for episodes in same_episodes]
            rewards = [reward for _, reward in of_bound]
            earned.append(list(zip(first, rewards, strict=True)))
        functions[facet] = functions_of(earned)[facet]
    return replace(bound, functions=functions)


def _highest_rewards(
    same_trajectory: Sequence[Sequence[UnitRecord[P]]],
) -> Iterator[tuple[UnitRecord[P], float | None]]:
    """Yield episodes with the highest possible reward that any run recorded; None if none did."""
    for same_episode in zip(*same_trajectory, strict=True):
        rewards = [record.payload.max_reward for record in same_episode]
        yield same_episode[0], max((r for r in rewards if r is not None), default=None)


def _missing_notes(runs: Sequence[_Drawn[Any]], facets: Mapping[str, Facet]) -> Iterator[str]:
    for name, facet in facets.items():
        if missing := [run.label for run in runs if name not in run.functions]:
            yield f"{facet.missing}: {', '.join(missing)}"


def _lent_notes(bound: _Drawn[Any], lent: Sequence[Facet]) -> Iterator[str]:
    for facet in lent:
        yield (
            f"{bound.label}, {facet.over}: its {next(iter(bound.counts))} are where the first of "
            "the runs has them"
        )


def _grid(facet: str, runs: Sequence[_Drawn[Any]]) -> np.ndarray:
    """Return all places where a run's function steps; evenly spaced ones if these are too many."""
    functions = [function for run in runs for function in run.functions.get(facet, ())]
    places = np.unique([place for function in functions for place in function.places])
    return places if len(places) <= _MAX_POINTS else np.linspace(places[0], places[-1], _MAX_POINTS)


def _mean_curve(functions: Sequence[StepFunction], grid: np.ndarray) -> Curve:
    """Return the mean of functions, one of each trajectory, up to the end of the longest."""

    def mean_at(place: float) -> MeanEstimate:
        return mean_over_clusters([function.at(place) for function in functions])

    last = max(function.places[-1] for function in functions)
    places = tuple(float(place) for place in grid if place <= last)
    return Curve(places, tuple(map(mean_at, places)))
