"""A trajectory while it is generated; the actions of a failed task can be removed again."""

from importlib.metadata import version
from typing import Any, NamedTuple

import msgspec

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
from infthor_eval.thor.view import SimulatorView, Vector

__all__ = ["Draft", "Length", "initial_scene"]


class Length(NamedTuple):
    """Numbers of low-level actions and of sub-goals."""

    low: int
    high: int


def initial_scene(settings: TrajectorySettings, view: SimulatorView, start: InitAction) -> Scene:
    """Return the initial state in the form of trajectories.

    Args:
        settings: settings of the trajectory.
        view: state of the scene.
        start: first pose of the agent.
    """
    return Scene(
        floor_plan=settings.scene,
        init_action=start,
        scene_num=_number(settings.scene),
        object_poses=[
            ObjectPose(item.name, _xyz(item.position), _xyz(item.rotation))
            for item in view.objects.values()
            if item.pickupable
        ],
        random_seed=settings.seed,
    )


class Draft:
    """The actions, sub-goals and tasks so far, and the log of every frame."""

    def __init__(self, settings: TrajectorySettings, scene: Scene, view: SimulatorView) -> None:
        """Start with the log of the first frame.

        Args:
            settings: settings of the trajectory.
            scene: the initial state.
            view: state of the simulator at the first frame.
        """
        self._settings = settings
        self._scene = scene
        self._low: list[LowAction] = []
        self._high: list[HighAction] = []
        # Encoded: thousands of Python objects per frame would slow down the garbage collector.
        self._log: list[bytes] = []
        self._sub_tasks: list[SubTask] = []
        self._sub_trajs: list[SubTrajectory] = []
        self._final: SubTask | None = None
        self._log_frame(view)

    @property
    def length(self) -> Length:
        """Length so far."""
        return Length(len(self._low), len(self._high))

    @property
    def n_tasks(self) -> int:
        """Number of tasks so far."""
        return len(self._sub_tasks)

    def add(self, trace: Trace) -> None:
        """Add the actions and sub-goals of a rollout."""
        for action in trace.actions:
            action.low.low_idx = len(self._low)
            self._low.append(action.low)
            self._log_frame(action.view)
        self._high += trace.high

    def cut(self, length: Length) -> None:
        """Remove what was added after the trajectory had this length."""
        del self._low[length.low :], self._high[length.high :], self._log[length.low + 1 :]

    def add_task(self, task: SubTask, start: Length, end: Length) -> None:
        """Add a completed task.

        Args:
            task: the task.
            start: length before its first action.
            end: length after its last action.
        """
        number = len(self._sub_tasks)
        self._sub_trajs.append(SubTrajectory(number, (start.high, end.high), (start.low, end.low), task.task_desc))
        self._sub_tasks.append(task)

    def make_last_task_final(self) -> None:
        """Make the last task the final one, which trajectories of test sets name once more beside the others."""
        self._final = self._sub_tasks[-1]

    def object_log(self) -> list[dict[str, Any]]:
        """Return the log of each frame, by object type."""
        return [msgspec.json.decode(entry) for entry in self._log]

    def trajectory(self, tried: dict[str, int], accepted: dict[str, int]) -> Trajectory:
        """Return the trajectory.

        Args:
            tried: numbers of tried tasks by type.
            accepted: numbers of the tasks that are part of the trajectory, by type.
        """
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
                "tried": tried,
                "accepted": accepted,
            },
        )

    def _log_frame(self, view: SimulatorView) -> None:
        entry = {"step": len(self._log), **msgspec.to_builtins(object_log(view))}
        self._log.append(msgspec.json.encode(entry))


def _number(scene: str) -> int:
    digits = "".join(letter for letter in scene if letter.isdigit())
    return int(digits) if digits else 0


def _image(low: LowAction) -> dict[str, Any]:
    """Return the entry of the frame after an action, with its name in a replay; frame 0 is before the first action."""
    assert low.low_idx is not None
    return {"high_idx": low.high_idx, "low_idx": low.low_idx, "image_name": f"{low.low_idx + 1:09d}.png"}


def _xyz(value: Vector) -> dict[str, float]:
    return {"x": value.x, "y": value.y, "z": value.z}
