"""Settings of a generated trajectory."""

from dataclasses import dataclass
from typing import Any

import msgspec

from infthor_eval.household.tasks import TaskType

__all__ = ["MAX_FAIL", "MIN_STEPS", "MIN_SUBGOALS", "TrajectorySettings"]

MIN_STEPS, MIN_SUBGOALS, MAX_FAIL = 300, 10, 20  # values of the paper's Algorithm 1


@dataclass(frozen=True)
class TrajectorySettings:
    """Settings of one trajectory.

    Attributes:
        scene: name of the scene.
        seed: seed of all random choices.
        min_steps: minimum number of low-level actions.
        min_subgoals: minimum number of tasks without the final one. Algorithm 1 calls a task's part a sub-goal.
        final_task: True to end with a final task (see the module `final_task`).
        task_types: task types to sample from, if the scene's room type has them.
        max_fail: maximum number of failed tasks; the final task has the same number of tries again.
    """

    scene: str
    seed: int
    min_steps: int = MIN_STEPS
    min_subgoals: int = MIN_SUBGOALS
    final_task: bool = False
    task_types: tuple[TaskType, ...] = tuple(TaskType)
    max_fail: int = MAX_FAIL

    @property
    def traj_id(self) -> str:
        """Name of the trajectory."""
        return f"{self.scene}-seed{self.seed}"

    def document(self) -> dict[str, Any]:
        """Return the settings as JSON values, as they are stored in trajectories."""
        return msgspec.json.decode(msgspec.json.encode(self), type=dict[str, Any])
