"""Cumulative reward along trajectories of an arm's episodes, from journals alone.

Every episode begins in the expert's own state, so after a failed one the next is independent of it.
An episode's place is the expert's low-level action that it replaces.
"""

from collections.abc import Sequence

from infthor_eval.episodes.curves import (
    Earned,
    Facet,
    Functions,
    RewardCurves,
    StepFunction,
    compute_curves,
)
from infthor_eval.manipulation.kinds import KIND_NAMES, ManipulationKind
from infthor_eval.manipulation.recorded.runs import ArmRun, shared_episodes, task_kinds
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.runs import UnitRecord

ALL = "all"  # name of the facet of both kinds together
_OVER = "the expert's step (low-level action)"
_END = "at step"


def arm_curves(runs: Sequence[ArmRun], tasks: str | None = None) -> RewardCurves:
    """Compute the curves of runs (at least one) in tasks; see `compute_curves`.

    The mean is over the same trajectories in every facet, so that the curves of the kinds add up to
    that of both. Episodes that a run excludes are left out of all of them.

    Args:
        tasks: names separated by commas; None for all that the runs share.
    """
    shared = shared_episodes(runs, tasks)
    facets = _facets(list(task_kinds(runs, shared.tasks)))

    def functions(trajectories: Sequence[Earned[ArmRecord]]) -> Functions:
        return {name: _functions(trajectories, name) for name in facets}

    return compute_curves(runs, shared, facets, functions, _count)


def _facets(kinds: Sequence[ManipulationKind]) -> dict[str, Facet]:
    if len(kinds) == 1:
        return {str(kinds[0]): Facet(_OVER, KIND_NAMES[kinds[0]], end_at=_END)}
    title = " and ".join(KIND_NAMES[kind].lower() for kind in kinds).capitalize()
    by_kind = {
        str(kind): Facet(_OVER, KIND_NAMES[kind], earned=f"of {KIND_NAMES[kind].lower()}s")
        for kind in kinds
    }
    return {ALL: Facet(_OVER, title, end_at=_END), **by_kind}


def _functions(trajectories: Sequence[Earned[ArmRecord]], facet: str) -> list[StepFunction]:
    functions = []
    for units in trajectories:
        chosen = [(r.payload.index, gain) for r, gain in units if facet in (ALL, r.payload.kind)]
        functions.append(StepFunction.of(chosen, start=0.0))
    return functions


def _count(episodes: Sequence[UnitRecord[ArmRecord]]) -> dict[str, int]:
    return {"episodes": len(episodes)}
