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
_LABELS = ("dx", "dy", "dz", "droll", "dpitch", "dyaw", "gripper")
_MOVES_ALONE = (0, 1, 2, 6)  # the numbers of an arm whose hand does not turn
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
_DOCS_MOVES = _DOCS.replace("is absolute", "adds up, from 0 (closed) to 1 (open)")


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
        self,
        task: str = "manipulathor_mini",
        data: str | None = None,
        cameras: str = "front",
        turns: bool = True,
    ) -> None:
        """Find the episodes.

        Args:
            task, data, cameras: as `arm_evaluation`; ConfigError for a bad one.
            turns: whether actions turn the hand, and set the gripper. The agents of inspect-robots
                take no angles, and only what a step changes: so without turns the gripper adds up.
        """
        self._turns = turns
        self._openness = 1.0
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
            action_space=_action_space(turns),
            observation_space=spaces.ObservationSpace(
                tuple(spaces.CameraSpec(name, size, size) for name in names), state=_STATE
            ),
            is_simulated=True,
            capabilities=_CAPABILITIES,
            docs=_DOCS if turns else _DOCS_MOVES,
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
            view = self.world.reset(scene.id)
        except InfthorError as error:
            raise EpisodeNotRun(str(error)) from error
        self._openness = view.hand.gripper
        return self._observation(view)

    def step(self, action: Action) -> StepResult:
        """Execute an action's numbers; raises EpisodeNotRun if the simulator is lost."""
        numbers = np.asarray(action.data, dtype=np.float64).tolist()
        try:
            view = self.world.step(self._delta(numbers))
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

    def _delta(self, numbers: list[float]) -> ArmDelta:
        x, y, z, *turn, gripper = numbers
        if self._turns:
            roll, pitch, yaw = turn
            return ArmDelta((x, y, z), (roll, pitch, yaw), gripper)
        self._openness = min(1.0, max(0.0, self._openness + gripper))
        return ArmDelta((x, y, z), (0.0, 0.0, 0.0), self._openness)

    def _observation(self, view: ArmView) -> Observation:
        state = {
            "eef_pos": np.array(view.hand.position),
            "eef_rot": np.array(view.hand.rotation),
            "gripper": np.array([view.hand.gripper]),
        }
        return Observation(dict(view.images), state, self._instruction)


def _action_space(turns: bool) -> spaces.Box:
    told = list(range(len(_MOST)) if turns else _MOVES_ALONE)
    semantics = spaces.ActionSemantics(
        control_mode="eef_delta_pose" if turns else "eef_delta_pos",
        rotation_repr="euler_xyz" if turns else "none",
        gripper="continuous",
        frame="base",
        dim_labels=tuple(_LABELS[number] for number in told),
    )
    most = _MOST[told]
    least = np.array((*-most[:-1], 0.0 if turns else -1.0))
    return spaces.Box(most.shape, least, most, semantics)


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
