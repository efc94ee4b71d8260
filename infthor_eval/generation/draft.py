"""A trajectory while it is generated; the actions of a failed task can be removed again."""

import copy
import os
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import distribution, version
from typing import Any, NamedTuple

import msgspec
from msgspec.structs import asdict

from infthor_eval import __version__
from infthor_eval.errors import UsageError
from infthor_eval.formats.object_ids import name_of_original
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

_TIME = "SOURCE_DATE_EPOCH"  # of reproducible-builds.org


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
            ObjectPose(name_of_original(loose.name), asdict(loose.position), asdict(loose.rotation))
            for loose in view.objects.values()
            if loose.pickupable
        ],
        random_seed=settings.seed,
        house=settings.house or msgspec.UNSET,
    )


@dataclass(frozen=True)
class _SubGoal:
    """A task or a put-down: its planning problem, its seed if it was sampled, and where it ends."""

    task: SubTask
    problem: str
    sample_seed: int | None
    end: Length


class Draft:
    """The actions, sub-goals and tasks so far, and the log of every frame.

    Every action belongs to a task or to the put-down of what a task left in the hand, as published.
    Algorithm 1 calls both sub-goals, as here; those of `plan.high_pddl` are parts of them.
    """

    def __init__(self, settings: TrajectorySettings, scene: Scene, view: SimulatorView) -> None:
        self._settings = settings
        self._scene = scene
        self._low: list[LowAction] = []
        self._high: list[HighAction] = []
        # Encoded: thousands of Python objects per frame would slow down the garbage collector.
        self._log: list[bytes] = []
        self._subgoals: list[_SubGoal] = []
        self._has_final = False
        self._log_frame(view)

    @property
    def length(self) -> Length:
        """Length so far."""
        return Length(len(self._low), len(self._high))

    @property
    def n_subgoals(self) -> int:
        """Number of tasks and put-downs so far."""
        return len(self._subgoals)

    @property
    def problems(self) -> list[str]:
        """The planning problem of each task and put-down, as PDDL."""
        return [subgoal.problem for subgoal in self._subgoals]

    def add(self, trace: Trace) -> None:
        """Add the actions of a rollout, which belong to the next task or put-down."""
        for action in trace.actions:
            action.low.low_idx = len(self._low)
            self._low.append(action.low)
            self._log_frame(action.view)
        self._high += trace.high

    def end_task(self, task: SubTask, problem: str) -> None:
        """End a sampled task, after its last action."""
        seed = self._settings.seed  # that of all random choices; the published ones differ by task
        self._subgoals.append(_SubGoal(task, problem, seed, self.length))

    def end_put_down(self, task: SubTask, problem: str) -> None:
        """End the put-down of what the last task left in the hand, after its last action.

        It gets the parameters of that task, as published.
        """
        params = self._subgoals[-1].task.pddl_params
        task = msgspec.structs.replace(task, pddl_params=params)
        self._subgoals.append(_SubGoal(task, problem, None, self.length))

    def keep(self, n_subgoals: int) -> None:
        """Remove everything after the first tasks and put-downs."""
        del self._subgoals[n_subgoals:]
        end = self._subgoals[-1].end if self._subgoals else Length(0, 0)
        del self._low[end.low :]
        del self._high[end.high :]
        del self._log[end.low + 1 :]

    def copy(self) -> "Draft":
        """Return a copy, which changes of this draft leave as it is."""
        other = copy.copy(self)
        for name, value in vars(self).items():
            if isinstance(value, list):
                setattr(other, name, list(value))
        return other

    def make_last_task_final(self) -> None:
        """Make the last task the final one, which test sets name once more beside the others."""
        self._has_final = True

    def object_log(self) -> list[dict[str, Any]]:
        """Return the log of each frame, by object type."""
        return [msgspec.json.decode(entry) for entry in self._log]

    def trajectory(self, history: dict[str, Any]) -> Trajectory:
        """Return the trajectory, with the history of its attempt (`AttemptStatistics.document`)."""
        return Trajectory(
            scene=self._scene,
            plan=ExpertPlan(self._low, self._high),
            traj_id=self._settings.traj_id,
            sub_tasks=[subgoal.task for subgoal in self._subgoals],
            sub_trajs=list(self._spans()),
            long_horizon_task=self._subgoals[-1].task if self._has_final else None,
            object_log=self.object_log(),
            images=[_image(low) for low in self._low],
            gen_info={
                **self._settings.document(),
                **provenance(),
                "sample_seeds": [subgoal.sample_seed for subgoal in self._subgoals],
                **history,
            },
        )

    def _spans(self) -> Iterator[SubTrajectory]:
        start = Length(0, 0)
        for number, subgoal in enumerate(self._subgoals):
            end = subgoal.end
            yield SubTrajectory(
                number, (start.high, end.high), (start.low, end.low), subgoal.task.task_desc
            )
            start = end

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


def provenance() -> dict[str, Any]:
    """Return the versions of the code, and when the trajectory was made, as JSON values.

    The same command writes the same bytes on the same installation, so the clock is not read.

    - `generator`, `ai2thor`: versions
    - `git`: first digits of the commit that the package was installed from; null if it was
      installed from a release or a folder
    - `created`: seconds since 1970, from the environment variable SOURCE_DATE_EPOCH; null without
      it
    """
    return {
        "generator": f"infthor-eval {__version__}",
        "ai2thor": version("ai2thor"),
        "git": _commit(),
        "created": _created(),
    }


def _commit() -> str | None:
    """Return the installed commit by the file that installers write (PEP 610)."""
    text = distribution("infthor-eval").read_text("direct_url.json")
    origin = msgspec.json.decode(text) if text is not None else {}
    commit = origin.get("vcs_info", {}).get("commit_id")
    return None if commit is None else str(commit)[:7]


def _created() -> int | None:
    text = os.environ.get(_TIME)
    if text is None:
        return None
    if not text.isdecimal():
        raise UsageError(f"{_TIME}: {text!r:.60} is not a whole number; give seconds since 1970")
    return int(text)
