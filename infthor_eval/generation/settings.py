"""Settings of a generated trajectory."""

from dataclasses import dataclass
from typing import Any

import msgspec

from infthor_eval.formats.object_ids import Words
from infthor_eval.household.tasks import SAMPLED, TaskType

__all__ = ["MAX_FAIL", "MIN_STEPS", "MIN_SUBGOALS", "TrajectorySettings"]

# Values of the paper's Algorithm 1
MIN_STEPS = 300
MIN_SUBGOALS = 10
MAX_FAIL = 20


@dataclass(frozen=True)
class TrajectorySettings:
    """Settings of one trajectory.

    Attributes:
        scene: name of the scene.
        seed: seed of all random choices.
        min_steps: minimum number of low-level actions.
        min_subgoals: minimum number of sub-goals, as Algorithm 1 calls tasks and put-downs, without
            the final task.
        final_task: True to end with a final task (see the module `final_task`).
        task_types: task types to sample from, if the scene's room type has them.
        max_fail: number of failed tasks in a row after which the last sub-goals are dropped.
        save_floor: number of steps from which a trajectory that gives up is kept as far as it got;
            0: never.
        look_around: True to walk long stretches with a level camera (see the module `look_around`).
        words: the words of tasks, plain English or drawn among the published generator's.
    """

    scene: str
    seed: int
    min_steps: int = MIN_STEPS
    min_subgoals: int = MIN_SUBGOALS
    final_task: bool = False
    task_types: tuple[TaskType, ...] = SAMPLED
    max_fail: int = MAX_FAIL
    save_floor: int = 0
    look_around: bool = False
    words: Words = Words.NATURAL

    @property
    def traj_id(self) -> str:
        """Name of the trajectory."""
        return f"{self.scene}-seed{self.seed}"

    def document(self) -> dict[str, Any]:
        """Return the settings as JSON values, as they are stored in trajectories.

        `look_around` and `words` are among them only where they are used: older trajectories have
        no such settings.
        """
        document = msgspec.json.decode(msgspec.json.encode(self), type=dict[str, Any])
        if not self.look_around:
            del document["look_around"]
        if self.words == Words.NATURAL:
            del document["words"]
        return document
