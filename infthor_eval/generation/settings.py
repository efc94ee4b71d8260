"""What a trajectory is made from."""

from dataclasses import dataclass
from typing import Any

import msgspec

from infthor_eval.household.tasks import TaskType

__all__ = ["MAX_FAIL", "MIN_STEPS", "MIN_SUBGOALS", "TrajectorySettings"]

MIN_STEPS, MIN_SUBGOALS, MAX_FAIL = 300, 10, 20  # Algorithm 1's, as published


@dataclass(frozen=True)
class TrajectorySettings:
    """What to make.

    Attributes:
        scene: name of the scene.
        seed: makes every choice.
        min_steps: low-level actions at least.
        min_subgoals: tasks at least, the final one apart. Algorithm 1 calls a task's part of a trajectory a sub-goal.
        final_task: whether a final task follows (see `final_task`).
        task_types: what to draw from, as far as it belongs in the scene.
        max_fail: tasks that may fail to be carried out; the final one has as many tries again.
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
        """The settings as trajectories hold them, in JSON's own types."""
        document: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(self))
        return document
