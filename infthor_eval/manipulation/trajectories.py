"""The trajectories of a task of manipulation, and the episodes in them."""

from collections.abc import Sequence
from dataclasses import dataclass

from infthor_eval.episodes.trajectory_sets import TaskTrajectory
from infthor_eval.errors import DataError
from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.formats.trajectory import LowAction, Trajectory, TrajectorySource
from infthor_eval.formats.twins import ArmChoice
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.storage.digests import digest

EXPERT_ACTIONS = {"PickupObject": ManipulationKind.PICKUP, "PutObject": ManipulationKind.PUT}


@dataclass(frozen=True)
class ArmEpisode:
    """A pick-up or put of the expert, which an arm does instead.

    Attributes:
        index: index of the expert's low-level action.
        object_type: type of the object that is picked up or put.
        receptacle_type: type of the receptacle that it is put into; None for pick-ups.
        choice: what an arm is told that stands before two things; None for the expert's actions.
    """

    index: int
    kind: ManipulationKind
    object_type: str
    receptacle_type: str | None = None
    choice: ArmChoice | None = None


@dataclass(frozen=True)
class ArmTrajectory(TaskTrajectory):
    """A trajectory with its episodes, in time order."""

    episodes: Sequence[ArmEpisode]


def arm_episodes(trajectory: Trajectory) -> list[ArmEpisode]:
    """Return a trajectory's pick-ups and puts in time order; DataError if one names no object."""
    return [
        _episode(number, low)
        for number, low in enumerate(trajectory.plan.low_actions)
        if low.api_action.action in EXPERT_ACTIONS
    ]


def choice_episodes(trajectory: Trajectory) -> list[ArmEpisode]:
    """Return the choices between two things at a trajectory's end, numbered behind its actions."""
    n_actions = len(trajectory.plan.low_actions)
    return [
        ArmEpisode(number, ManipulationKind.PICKUP, object_type_of(choice.target), choice=choice)
        for number, choice in enumerate(trajectory.arm_choices, n_actions)
    ]


def read_arm_trajectory(source: TrajectorySource) -> ArmTrajectory:
    """Read a trajectory and its episodes; raises DataError if it cannot be used."""
    trajectory = source.read()
    try:
        episodes = [*arm_episodes(trajectory), *choice_episodes(trajectory)]
    except DataError as error:
        raise DataError(f"{source.place}: {error}") from error
    return ArmTrajectory(trajectory, digest(source.raw.strip()), episodes)


def _episode(number: int, low: LowAction) -> ArmEpisode:
    recorded = low.api_action
    if recorded.object_id is None or (
        recorded.action == "PutObject" and recorded.receptacle_id is None
    ):
        raise DataError(f"action {number} ({recorded.action}) names no object; restore the file")
    receptacle = None if recorded.receptacle_id is None else object_type_of(recorded.receptacle_id)
    kind = EXPERT_ACTIONS[recorded.action]
    where = receptacle if kind == ManipulationKind.PUT else None
    return ArmEpisode(number, kind, object_type_of(recorded.object_id), where)
