"""Settings of a generated trajectory."""

from dataclasses import dataclass, field
from typing import Any, Literal

from infthor_eval.formats.object_ids import Words
from infthor_eval.household.possible_tasks import usual_tasks
from infthor_eval.household.tasks import SAMPLED, TaskType

# Values of the paper's Algorithm 1
MIN_STEPS = 300
MIN_SUBGOALS = 10
MAX_FAIL = 20

MEMORY: Literal["memory"] = "memory"
FinalTask = bool | Literal["memory"]


@dataclass(frozen=True)
class TrajectorySettings:
    """Settings of one trajectory.

    Attributes:
        scene: name of the scene.
        seed: seed of all random choices.
        min_steps: minimum number of low-level actions.
        min_subgoals: minimum number of sub-goals, as Algorithm 1 calls tasks and put-downs, without
            the final task.
        final_task: True to end with a final task (see the module `final_task`); MEMORY for one on
            an object seen early alone and one seen late alone.
        task_types: task types to sample from, if the scene's room type has them.
        scene_goal_filter: True to sample only task types that the published tables name for the
            scene's room type; False to sample any that its objects allow.
        max_fail: number of failed tasks in a row after which the last sub-goals are dropped.
        save_floor: number of steps from which a trajectory that gives up is kept as far as it got;
            0: never.
        look_around: True to walk long stretches with a level camera (see the module `look_around`).
        words: the words of tasks, plain English or drawn among the published generator's.
        house: JSON of the ProcTHOR house that the scene is; None for one that simulators know.
    """

    scene: str
    seed: int
    min_steps: int = MIN_STEPS
    min_subgoals: int = MIN_SUBGOALS
    final_task: FinalTask = False
    task_types: tuple[TaskType, ...] = SAMPLED
    scene_goal_filter: bool = True
    max_fail: int = MAX_FAIL
    save_floor: int = 0
    look_around: bool = False
    words: Words = Words.NATURAL
    house: dict[str, Any] | None = field(default=None, hash=False, repr=False)

    @property
    def traj_id(self) -> str:
        """Name of the trajectory."""
        return f"{self.scene}-seed{self.seed}"

    def sampled_types(self) -> frozenset[TaskType]:
        """Return the task types that tasks are sampled from."""
        usual = usual_tasks(self.scene) if self.scene_goal_filter else SAMPLED
        return frozenset(usual).intersection(self.task_types)

    def document(self) -> dict[str, Any]:
        """Return the settings as JSON values for `gen_info`, by the published names if they have
        one."""
        return {
            "scene": self.scene,
            "min_step": self.min_steps,
            "min_subgoal": self.min_subgoals,
            "max_fail": self.max_fail,
            "seed": self.seed,
            "save_floor": self.save_floor,
            # Never: the embedded simulator repeats every action exactly.
            "replay_every": 0,
            "scene_goal_filter": self.scene_goal_filter,
            "look_around": self.look_around,
            "final_task": self.final_task,
            "task_types": [str(task_type) for task_type in self.task_types],
            "words": str(self.words),
        }
