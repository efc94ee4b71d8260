"""What a trajectory is made from."""

from dataclasses import dataclass
from typing import Any

import msgspec

from infthor_eval.household.tasks import TaskType

__all__ = ["TrajectorySettings"]


@dataclass(frozen=True)
class TrajectorySettings:
    """What to make.

    Attributes:
        scene: name of the scene.
        seed: makes every choice.
        min_steps: low-level actions at least.
        min_subgoals: sub-goals at least.
        final_task: whether a final task follows (see `final_task`).
        task_types: what to draw from.
    """

    scene: str
    seed: int
    min_steps: int
    min_subgoals: int
    final_task: bool = False
    task_types: tuple[TaskType, ...] = tuple(TaskType)

    @property
    def traj_id(self) -> str:
        """Name of the trajectory."""
        return f"{self.scene}-seed{self.seed}"

    def document(self) -> dict[str, Any]:
        """The settings as trajectories hold them, in JSON's own types."""
        document: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(self))
        return document
