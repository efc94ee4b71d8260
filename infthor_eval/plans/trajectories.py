"""The trajectories of a task of plans."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from infthor_eval.episodes.trajectory_sets import TaskTrajectory
from infthor_eval.errors import DataError
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.step_log import ObjectLog
from infthor_eval.formats.trajectory import TrajectorySource
from infthor_eval.plans.history.clue_steps import clue_step, object_logs
from infthor_eval.plans.plan import Plan, TrajectoryTask, plans_of, tasks_of
from infthor_eval.storage.digests import digest


@dataclass(frozen=True)
class PlanTrajectory(TaskTrajectory):
    """A trajectory with its plans, in time order, and the tasks that these belong to."""

    plans: Sequence[Plan]
    tasks: Sequence[TrajectoryTask]

    def first_frame(self, plan: Plan) -> int:
        """Return the frame that the task of a plan begins with."""
        return next(
            other.low[0] for other in self.plans if other.task == plan.task and other.in_task
        )

    def clue(self, plan: Plan) -> int | None:
        """Return the last frame up to its task's first that shows a plan's need (`clue_step`)."""
        return clue_step(self._logs, self.data, plan, self.first_frame(plan))

    @cached_property
    def _logs(self) -> Sequence[ObjectLog]:
        return object_logs(self.data)


def read_plan_trajectory(source: TrajectorySource, words: Words) -> PlanTrajectory:
    """Read a trajectory and its plans in words of these; raises DataError if it cannot be used."""
    trajectory = source.read()
    plans = plans_of(trajectory, words)
    if not plans:
        raise DataError(f"{source.place}: no plan with an action; leave it out")
    return PlanTrajectory(trajectory, digest(source.raw.strip()), plans, tasks_of(trajectory))
