"""A trajectory in the making: what is kept of it, and taken back where a task does not work out."""

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
    """The initial state as trajectories hold it.

    Args:
        settings: of the trajectory.
        view: the scene as it is.
        start: where the agent is to begin.
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
        """Begin with the first frame.

        Args:
            settings: what is being made.
            scene: the initial state.
            view: what the agent sees first.
        """
        self._settings = settings
        self._scene = scene
        self._low: list[LowAction] = []
        self._high: list[HighAction] = []
        self._log: list[bytes] = []  # encoded: what is kept of every step must not weigh on the garbage collector
        self._sub_tasks: list[SubTask] = []
        self._sub_trajs: list[SubTrajectory] = []
        self._final: SubTask | None = None
        self._note(view)

    @property
    def length(self) -> Length:
        """How long it is so far."""
        return Length(len(self._low), len(self._high))

    @property
    def n_tasks(self) -> int:
        """Number of tasks so far."""
        return len(self._sub_tasks)

    def add(self, trace: Trace) -> None:
        """Add what a rollout did."""
        for action in trace.actions:
            action.low.low_idx = len(self._low)
            self._low.append(action.low)
            self._note(action.view)
        self._high += trace.high

    def cut(self, length: Length) -> None:
        """Take back what was added since it had a length."""
        del self._low[length.low :], self._high[length.high :], self._log[length.low + 1 :]

    def add_task(self, task: SubTask, start: Length, end: Length) -> None:
        """Note which part of it carried a task out.

        Args:
            task: the task.
            start: the length before it.
            end: the length after it.
        """
        number = len(self._sub_tasks)
        self._sub_trajs.append(SubTrajectory(number, (start.high, end.high), (start.low, end.low), task.task_desc))
        self._sub_tasks.append(task)

    def make_last_task_final(self) -> None:
        """Take the last task for the final one, which a test set names once more beside the others."""
        self._final = self._sub_tasks[-1]

    def object_log(self) -> list[dict[str, Any]]:
        """What each frame shows, by object type."""
        return [msgspec.json.decode(entry) for entry in self._log]

    def trajectory(self, tried: dict[str, int], accepted: dict[str, int]) -> Trajectory:
        """The trajectory.

        Args:
            tried: number of tasks tried, by type.
            accepted: number of those that are part of it.
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

    def _note(self, view: SimulatorView) -> None:
        entry = {"step": len(self._log), **msgspec.to_builtins(object_log(view))}
        self._log.append(msgspec.json.encode(entry))


def _number(scene: str) -> int:
    digits = "".join(letter for letter in scene if letter.isdigit())
    return int(digits) if digits else 0


def _image(low: LowAction) -> dict[str, Any]:
    """The frame after an action, by the name that a replay gives it; frame 0 is before the first action."""
    assert low.low_idx is not None
    return {"high_idx": low.high_idx, "low_idx": low.low_idx, "image_name": f"{low.low_idx + 1:09d}.png"}


def _xyz(value: Vector) -> dict[str, float]:
    return {"x": value.x, "y": value.y, "z": value.z}
