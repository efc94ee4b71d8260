"""Our episodes of arms in inspect-robots: an embodiment, and tasks whose scenes are episodes.

`pyproject.toml` registers them (`docs/howto/inspect-robots.md`).
"""

import math
from functools import partial
from typing import Any

import numpy as np
from inspect_robots import spaces
from inspect_robots.embodiment import PRIVILEGED_SUCCESS, RENDERABLE, RESETTABLE, EmbodimentInfo
from inspect_robots.errors import ConfigError, PolicyError
from inspect_robots.scene import Scene
from inspect_robots.scorer import success_at_end
from inspect_robots.task import Task
from inspect_robots.types import Action, Observation, StepResult

from infthor_eval import __version__
from infthor_eval.errors import InfthorError
from infthor_eval.manipulation.records import ArmEnded
from infthor_eval.manipulation.worlds import ArmView, ArmWorld, arm_evaluation
from model_adapters import ArmDelta

_MOST = np.array((0.1, 0.1, 0.1, math.pi, math.pi, math.pi, 1.0))  # metres, radians, openness
_SEMANTICS = spaces.ActionSemantics(
    control_mode="eef_delta_pose",
    rotation_repr="euler_xyz",
    gripper="continuous",
    frame="base",
    dim_labels=("dx", "dy", "dz", "droll", "dpitch", "dyaw", "gripper"),
)
_STATE = spaces.StateSpec(
    (
        spaces.StateField("eef_pos", (3,), "m"),
        spaces.StateField("eef_rot", (3,), "rad"),
        spaces.StateField("gripper", (1,), "normalized"),
    )
)
_CAPABILITIES = frozenset({RESETTABLE, PRIVILEGED_SUCCESS, RENDERABLE})
_DOCS = (
    "The hand moves in the frame of the robot's base: x forward, y left, z up, in metres and "
    "radians; a movement is at most 0.1 m long. The gripper is absolute: below 0.5 it closes "
    "around the target if that is in its sphere, else it opens and releases what it holds."
)


class EpisodeNotRun(PolicyError):
    """The episode cannot begin here, or its simulator was lost, so it has no score.

    After errors of a policy alone does inspect-robots go on to the next scene.
    """


class InfthorArm:
    """An arm in a household, whose scenes are the episodes of tasks.

    Attributes:
        info: what inspect-robots is told of it.
        world: the world that the episodes are in.
    """

    def __init__(
        self, task: str = "manipulathor_mini", data: str | None = None, cameras: str = "front"
    ) -> None:
        """Find the episodes; arguments as `arm_evaluation`, ConfigError for a bad one."""
        self.world = _world(task, data, cameras=cameras)
        self._task = task
        self._instruction: str | None = None
        sizes = {settings.image_size for settings in self.world.settings.values()}
        if len(sizes) > 1:
            raise ConfigError(f"{task}: frames of {sorted(sizes)} pixels; give tasks of one size")
        (size,) = sizes
        names = ("agentview", "wrist") if "wrist" in cameras else ("agentview",)
        self.info = EmbodimentInfo(
            name="infthor-arm",
            action_space=spaces.Box(_MOST.shape, np.array((*-_MOST[:-1], 0.0)), _MOST, _SEMANTICS),
            observation_space=spaces.ObservationSpace(
                tuple(spaces.CameraSpec(name, size, size) for name in names), state=_STATE
            ),
            is_simulated=True,
            capabilities=_CAPABILITIES,
            docs=_DOCS,
            environment_id="infthor-eval",
            environment_revision=__version__,
        )

    def reset(self, scene: Scene, *, seed: int | None = None) -> Observation:
        """Begin a scene's episode; the seed changes nothing.

        ConfigError if the scene is none of the tasks', EpisodeNotRun if it cannot begin.
        """
        if scene.id not in self.world.units:
            raise ConfigError(
                f"{scene.id} is no episode of {self._task}; give the embodiment the task and data "
                "of the task's scenes"
            )
        self._instruction = scene.instruction
        try:
            return self._observation(self.world.reset(scene.id))
        except InfthorError as error:
            raise EpisodeNotRun(str(error)) from error

    def step(self, action: Action) -> StepResult:
        """Execute seven numbers; raises EpisodeNotRun if the simulator is lost."""
        numbers = np.asarray(action.data, dtype=np.float64).tolist()
        delta = ArmDelta(tuple(numbers[:3]), tuple(numbers[3:6]), numbers[6])
        try:
            view = self.world.step(delta)
        except InfthorError as error:
            raise EpisodeNotRun(str(error)) from error
        is_limit = view.ended is ArmEnded.LIMIT
        reason = "success" if view.success else "max_steps" if is_limit else "failure"
        return StepResult(
            self._observation(view),
            reward=view.reward,
            terminated=view.ended is not None and not is_limit,
            truncated=is_limit,
            termination_reason=reason if view.ended else None,
            info={"success": view.success, "distance": view.distance},
        )

    def close(self) -> None:
        """Stop the simulators."""
        self.world.close()

    def _observation(self, view: ArmView) -> Observation:
        state = {
            "eef_pos": np.array(view.hand.position),
            "eef_rot": np.array(view.hand.rotation),
            "gripper": np.array([view.hand.gripper]),
        }
        return Observation(dict(view.images), state, self._instruction)


def _task(*, name: str, task: str, data: str | None = None, limit: int | None = None) -> Task:
    world = _world(task, data, limit=limit)
    scenes = [Scene(key, unit.payload.instruction) for key, unit in world.units.items()]
    about = {"task": task, "data": data, "limit": limit}
    return Task(name, scenes, success_at_end(), max_steps=world.max_steps, metadata=about)


# What `-T task=...,data=...,limit=...` changes; as `arm_evaluation` has them.
pickup_task = partial(_task, name="infthor-pickup", task="manipulathor_pickup_mini")
put_task = partial(_task, name="infthor-put", task="manipulathor_put_mini")


def _world(task: str, data: str | None, **options: Any) -> ArmWorld:
    try:
        return ArmWorld(arm_evaluation(task, data, **options))
    except InfthorError as error:
        raise ConfigError(str(error)) from error
