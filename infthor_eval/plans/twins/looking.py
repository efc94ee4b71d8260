"""Where an agent looks first for the object of a final task that has a twin."""

from collections.abc import Iterable, Iterator, Sequence

import msgspec

from infthor_eval.household.containment import contents_of
from infthor_eval.household.first_place import first_place
from infthor_eval.plans.environment import Observation, StepOutcome
from infthor_eval.plans.plan import Plan
from infthor_eval.plans.records import TwinRecord
from infthor_eval.plans.trajectories import PlanTrajectory
from infthor_eval.thor.view import AgentPose


def twin_record(trajectory: PlanTrajectory, plan: Plan) -> TwinRecord | None:
    """Return the record of a plan's pair before anybody acts; None if it has no twin."""
    twin = trajectory.data.twin
    if twin is None or not plan.is_final:
        return None
    finds = not any(other.is_final for other in trajectory.plans if other.index < plan.index)
    return TwinRecord(pair=twin.pair, base=twin.base, finds=finds)


def completed_twin(
    begun: TwinRecord,
    trajectory: PlanTrajectory,
    item: str,
    start: Observation,
    outcomes: Sequence[StepOutcome],
) -> TwinRecord:
    """Return the record with where the agent looked.

    Args:
        begun: the record of the plan that finds the object.
        trajectory: its trajectory, which has a twin.
        item: id of the object.
        start: observation at the plan's start.
        outcomes: the agent's steps.
    """
    twin = trajectory.data.twin
    assert twin is not None
    looks = list(_looks(item, start, outcomes))
    return msgspec.structs.replace(
        begun,
        first=first_place(twin.places, [(pose, opened) for pose, opened, _ in looks]),
        n_opened=sum(opened is not None and not holds for _, opened, holds in looks),
    )


def worlds_together(trajectories: Iterable[PlanTrajectory]) -> list[list[PlanTrajectory]]:
    """Return trajectories with both worlds of a pair together; others are alone."""
    groups: dict[str, list[PlanTrajectory]] = {}
    for trajectory in trajectories:
        twin = trajectory.data.twin
        key = f"alone {trajectory.traj_id}" if twin is None else f"pair {twin.pair}"
        groups.setdefault(key, []).append(trajectory)
    return list(groups.values())


def _looks(
    item: str, start: Observation, outcomes: Sequence[StepOutcome]
) -> Iterator[tuple[AgentPose, str | None, bool]]:
    """Yield the pose after each step, what it opened, and whether the object was in that."""
    before = start.view
    for outcome in outcomes:
        view = outcome.observation.view
        call = outcome.info.call or {}
        opened = None
        if call.get("action") == "OpenObject" and view.success:
            opened = str(call["objectId"])
        yield view.agent, opened, opened is not None and item in contents_of(opened, before.objects)
        before = view
