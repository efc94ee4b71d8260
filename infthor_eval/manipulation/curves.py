"""How reward adds up along trajectories in which an arm does the expert's pick-ups and puts, from journals alone.

Every episode begins in the expert's own state: after a failed one the expert takes over, and the next is independent of
it. An episode stands at the expert's low-level action that it stands for, and earns what its record says.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence

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
from infthor_eval.manipulation.curve_runs import ArmRun, SharedEpisodes, shared_episodes
from infthor_eval.manipulation.kinds import SHORT, ErrandKind
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.runs import UnitRecord

__all__ = ["ALL", "arm_curves"]

ALL = "all"  # name of the facet of both kinds together
_OVER = "the expert's step (low-level action)"
_END = "at step"

Record = UnitRecord[ArmRecord]
Functions = dict[str, list[StepFunction]]  # by facet, one of each trajectory


def arm_curves(runs: Sequence[ArmRun], tasks: str | None = None) -> RewardCurves:
    """The curves of some runs, on the trajectories and episodes that all of them have: of both kinds, and of each.

    The mean is over the same trajectories everywhere, so that the curves of the kinds add up to that of both.
    Episodes that a run excludes are left out of all of them; failed ones earn nothing.

    Args:
        runs: at least one.
        tasks: which tasks of theirs, separated by commas; None takes all that they share.

    Raises:
        UsageError: they share no task or several of a kind, or their successes earn differently.
        DataError: they share no trajectory, or a journal is not what it should be.
    """
    shared = shared_episodes(runs, tasks)
    facets = _facets(list(shared.tasks))
    earned = [_functions(records, facets, _earned) for records in shared.records]
    grids = {name: grid_of([found[name] for found in earned]) for name in facets}
    planners = [run for run in runs if run.is_planner]
    bound = planners[0] if len(planners) == 1 else None
    drawn = [
        _run_curves(run, records, _curves(found, grids), is_bound=run is bound)
        for run, records, found in zip(runs, shared.records, earned, strict=True)
    ]
    if bound is None:
        drawn.append(_most(runs, shared, facets, grids))
    return RewardCurves(
        task=shared.named,
        facets=facets,
        runs=tuple(sorted(drawn, key=lambda run: run.is_bound)),
        n_trajectories=len(shared.trajectories),
        notes=shared.notes,
    )


def _facets(kinds: Sequence[ErrandKind]) -> dict[str, Facet]:
    if len(kinds) == 1:
        return {str(kinds[0]): Facet(_OVER, SHORT[kinds[0]], end_at=_END)}
    every = {ALL: Facet(_OVER, " and ".join(SHORT[kind].lower() for kind in kinds).capitalize(), end_at=_END)}
    return every | {str(kind): Facet(_OVER, SHORT[kind], earned=f"of {SHORT[kind].lower()}s") for kind in kinds}


def _functions(
    trajectories: Sequence[Sequence[Record]], facets: Iterable[str], points: Callable[[Record], float]
) -> Functions:
    return {
        name: [
            StepFunction.of([(r.payload.index, points(r)) for r in records if name in (ALL, r.payload.kind)], start=0.0)
            for records in trajectories
        ]
        for name in facets
    }


def _curves(functions: Functions, grids: Mapping[str, np.ndarray]) -> dict[str, Curve]:
    return {name: mean_curve(found, grids[name]) for name, found in functions.items()}


def _earned(record: Record) -> float:
    return 0.0 if record.failure is not None else record.payload.reward


def _run_curves(
    run: ArmRun, records: Sequence[Sequence[Record]], curves: Mapping[str, Curve], *, is_bound: bool
) -> RunCurves:
    episodes = [record for trajectory in records for record in trajectory]
    n_failed = sum(record.failure is not None for record in episodes)
    return RunCurves(run.label, is_bound, run.about.is_embedded, curves, _counts(len(episodes), n_failed))


def _most(
    runs: Sequence[ArmRun], shared: SharedEpisodes, facets: Iterable[str], grids: Mapping[str, np.ndarray]
) -> RunCurves:
    """What a success in every episode earns; all runs agree on it."""
    functions = _functions(shared.records[0], facets, lambda record: record.payload.max_reward)
    is_embedded = all(run.about.is_embedded for run in runs)
    counts = _counts(sum(map(len, shared.records[0])), 0)
    return RunCurves(AT_MOST, True, is_embedded, _curves(functions, grids), counts)


def _counts(n_episodes: int, n_failed: int) -> dict[str, int]:
    return {"episodes": n_episodes, "failed": n_failed}
