"""Where a plan's object was last in view before it is needed: what a memory has to recall.

The trajectory's object log has the types in view at each frame. A final task needs an object and a
place that were seen at the two ends of the trajectory before it
(`infthor_eval.generation.final_task`).
"""

from collections.abc import Sequence

import msgspec

from infthor_eval.formats.step_log import ObjectLog
from infthor_eval.formats.trajectory import HighAction, Trajectory
from infthor_eval.plans.plan import Plan, PlanKind

# Plans that have their receptacle or tool as the last argument; it is what the agent must find.
_TO_RECEPTACLE = {PlanKind.PUT, PlanKind.CLEAN, PlanKind.HEAT, PlanKind.COOL}


def object_logs(trajectory: Trajectory) -> Sequence[ObjectLog]:
    """Return what each frame shows, by the trajectory's log; empty if it lacks a frame."""
    log = trajectory.object_log
    if len(log) != len(trajectory.plan.low_actions) + 1:
        return ()
    try:
        return [msgspec.convert(entry, ObjectLog) for entry in log]
    except msgspec.ValidationError:
        return ()  # a log of another form tells nothing about frames


def clue_step(
    logs: Sequence[ObjectLog], trajectory: Trajectory, plan: Plan, before: int
) -> int | None:
    """Return the last frame, up to `before`, with a plan's object (or goal receptacle) in view.

    None if it was never in view, or if that is not known.
    """
    wanted = _wanted(trajectory.plan.high_pddl[plan.high], plan.kind)
    for frame in reversed(range(min(before + 1, len(logs)))):
        if wanted in map(str.lower, logs[frame].visible):
            return frame
    return None


def _wanted(high: HighAction, kind: PlanKind) -> str:
    args = high.discrete_action.args
    names = args if isinstance(args, list) else []
    return str(names[-1 if kind in _TO_RECEPTACLE else 0]).lower() if names else ""
