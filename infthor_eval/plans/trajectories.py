"""The trajectories that a task of plans is about."""

from collections.abc import Sequence
from dataclasses import dataclass

from infthor_eval.episodes.trajectory_sets import TrajectorySet, find_trajectories
from infthor_eval.errors import DataError
from infthor_eval.formats.digests import digest
from infthor_eval.formats.trajectory import Trajectory, TrajectorySource
from infthor_eval.plans.plan import Plan, TrajectoryTask, plans_of, tasks_of

__all__ = ["Course", "Courses", "find_courses", "read_course"]


@dataclass(frozen=True)
class Course:
    """A trajectory that an agent is led through.

    Attributes:
        trajectory: the trajectory.
        plans: its plans.
        tasks: their tasks.
        digest: of its file.
    """

    trajectory: Trajectory
    plans: Sequence[Plan]
    tasks: Sequence[TrajectoryTask]
    digest: str

    @property
    def traj_id(self) -> str:
        """The trajectory's name."""
        return self.trajectory.traj_id


Courses = TrajectorySet[Course]


def find_courses(data: str | None, bundled: str | None) -> Courses:
    """Read the trajectories; see `find_trajectories`."""
    return find_trajectories(data, bundled, read_course)


def read_course(source: TrajectorySource) -> Course:
    """What evaluation needs of a trajectory.

    Raises:
        DataError: it cannot be used.
    """
    trajectory = source.read()
    plans = plans_of(trajectory)
    if not plans:
        raise DataError(f"{source.place}: no plan with an action; leave it out")
    return Course(trajectory, plans, tasks_of(trajectory), digest(source.raw.strip()))
