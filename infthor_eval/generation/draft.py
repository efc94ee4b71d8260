"""A trajectory while it is generated; the actions of a failed task can be removed again."""

import copy
from importlib.metadata import version
from typing import Any, NamedTuple

import msgspec
from msgspec.structs import asdict

from infthor_eval import __version__
from infthor_eval.formats.trajectory import (
    ExpertPlan,
    HighAction,
    InitAction,
    LowAction,
    ObjectPose,
    Scene,
    SubTask,
    SubTrajectory,
    Trajectory,
)
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.generation.trace import Trace
from infthor_eval.thor.recorder import object_log
from infthor_eval.thor.view import SimulatorView

__all__ = ["Draft", "Length", "initial_scene"]


class Length(NamedTuple):
    """Numbers of low-level actions and of sub-goals."""

    low: int
    high: int


def initial_scene(settings: TrajectorySettings, view: SimulatorView, start: InitAction) -> Scene:
    """Return the initial state, with the first pose of the agent, in the form of trajectories."""
    return Scene(
        floor_plan=settings.scene,
        init_action=start,
        scene_num=int("".join(filter(str.isdigit, settings.scene)) or 0),
        object_poses=[
            ObjectPose(loose.name, asdict(loose.position), asdict(loose.rotation))
            for loose in view.objects.values()
            if loose.pickupable
        ],
        random_seed=settings.seed,
    )


class Draft:
    """The actions, sub-goals and tasks so far, and the log of every frame."""

    def __init__(self, settings: TrajectorySettings, scene: Scene, view: SimulatorView) -> None:
        self._settings = settings
        self._scene = scene
        self._low: list[LowAction] = []
        self._high: list[HighAction] = []
        # Encoded: thousands of Python objects per frame would slow down the garbage collector.
        self._log: list[bytes] = []
        self._sub_tasks: list[SubTask] = []
        self._sub_trajs: list[SubTrajectory] = []
        self._final: SubTask | None = None
        self._n_put_downs = 0
        self._log_frame(view)

    @property
    def length(self) -> Length:
        """Length so far."""
        return Length(len(self._low), len(self._high))

    @property
    def n_tasks(self) -> int:
        """Number of tasks so far."""
        return len(self._sub_tasks)

    @property
    def n_subgoals(self) -> int:
        """Number of sub-goals as Algorithm 1 counts: tasks, and put-downs of what they left."""
        return len(self._sub_tasks) + self._n_put_downs

    def add(self, trace: Trace) -> None:
        """Add the actions and sub-goals of a rollout."""
        for action in trace.actions:
            action.low.low_idx = len(self._low)
            self._low.append(action.low)
            self._log_frame(action.view)
        self._high += trace.high

    def cut(self, length: Length) -> None:
        """Remove what was added after the trajectory had this length."""
        del self._low[length.low :]
        del self._high[length.high :]
        del self._log[length.low + 1 :]

    def add_task(self, task: SubTask, start: Length, end: Length) -> None:
        """Add a completed task, with the lengths before its first action and after its last one.

        Actions after its end, which are part of the draft already, put down what it left in the
        hand.
        """
        number = len(self._sub_tasks)
        self._n_put_downs += self.length.low > end.low
        self._sub_trajs.append(
            SubTrajectory(number, (start.high, end.high), (start.low, end.low), task.task_desc)
        )
        self._sub_tasks.append(task)

    def drop_last_task(self) -> None:
        """Remove the last task with its actions, and those that put down what it left."""
        self._sub_tasks.pop()
        part = self._sub_trajs.pop()
        self._n_put_downs -= self.length.low > part.low_pddl_idx[1]
        self.cut(Length(part.low_pddl_idx[0], part.high_pddl_idx[0]))

    def copy(self) -> "Draft":
        """Return a copy, which changes of this draft leave as it is."""
        other = copy.copy(self)
        for name, value in vars(self).items():
            if isinstance(value, list):
                setattr(other, name, list(value))
        return other

    def make_last_task_final(self) -> None:
        """Make the last task the final one, which test sets name once more beside the others."""
        self._final = self._sub_tasks[-1]

    def object_log(self) -> list[dict[str, Any]]:
        """Return the log of each frame, by object type."""
        return [msgspec.json.decode(entry) for entry in self._log]

    def trajectory(self, history: dict[str, Any]) -> Trajectory:
        """Return the trajectory, with the history of its attempt (`AttemptStatistics.document`)."""
        return Trajectory(
            scene=self._scene,
            plan=ExpertPlan(self._low, self._high),
            traj_id=self._settings.traj_id,
            sub_tasks=self._sub_tasks,
            sub_trajs=self._sub_trajs,
            long_horizon_task=self._final,
            object_log=self.object_log(),
            images=[_image(low) for low in self._low],
            gen_info={
                "generator": f"infthor-eval {__version__}",
                "ai2thor": version("ai2thor"),
                "settings": self._settings.document(),
                **history,
            },
        )

    def _log_frame(self, view: SimulatorView) -> None:
        entry = {"step": len(self._log), **msgspec.to_builtins(object_log(view))}
        self._log.append(msgspec.json.encode(entry))


def _image(low: LowAction) -> dict[str, Any]:
    """Return the entry of the frame after an action; frame 0 is before the first action."""
    assert low.low_idx is not None
    return {
        "high_idx": low.high_idx,
        "low_idx": low.low_idx,
        "image_name": f"{low.low_idx + 1:09d}.png",
    }
