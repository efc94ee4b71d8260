"""Our episodes of arms as a benchmark of vla-eval (`docs/howto/vla-eval.md`).

Its model servers drive the arm: a YAML of theirs has
`benchmark: "infthor_eval.harness.vla_eval:InfthorArm"`.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from vla_eval import specs
from vla_eval.benchmarks.base import StepBenchmark, StepResult

from infthor_eval.errors import UsageError
from infthor_eval.manipulation.conversion import Call
from infthor_eval.manipulation.worlds import ArmView, ArmWorld, arm_evaluation
from model_adapters import ArmDelta


class InfthorArm(StepBenchmark):
    """Pick-ups and puts with an arm, one task of vla-eval an episode.

    An episode that cannot begin here, which infthor-eval leaves out, fails as "env_start".

    Attributes:
        world: the world that the episodes are in.
    """

    render_backends = frozenset({"cpu", "gpu"})

    def __init__(
        self,
        task: str = "manipulathor_mini",
        data: str | None = None,
        limit: int | None = None,
        cameras: str = "front",
        state: bool = False,
        translation_scale: float = 0.05,
        rotation_scale: float = 0.5,
        calls: bool = False,
        send_wrist_image: bool = False,
        send_state: bool = False,
    ) -> None:
        """Find the episodes.

        Args:
            task: names of tasks or groups of infthor-eval, separated by commas.
            data: file or folder of trajectories, for tasks that bring none.
            limit: number of episodes of each task, chosen as infthor-eval does; None for all.
            cameras: "front" or "front,wrist".
            state: whether a model is told of its hand.
            translation_scale: metres of a translation of 1.
            rotation_scale: radians of a rotation of 1.
            calls: whether `calls` of AI2-THOR's are executed in place of `actions`. They can do
                anything, so they are for bounds alone.
            send_wrist_image: as "front,wrist", by the name that model servers ask for.
            send_state: as `state`, likewise.

        UsageError or DataError for a value that cannot be used.
        """
        super().__init__()
        for name, scale in (("translation", translation_scale), ("rotation", rotation_scale)):
            if not 0 < scale < float("inf"):
                raise UsageError(f"{name}_scale must be above 0, not {scale}")
        self._scales = np.repeat((translation_scale, rotation_scale), 3)
        self._state = state or send_state
        self._calls = calls
        cameras = "front,wrist" if send_wrist_image else cameras
        self._wrist = "wrist" in cameras
        self.world = ArmWorld(arm_evaluation(task, data, limit, cameras))

    @classmethod
    def configure_render(cls, mode: str) -> dict[str, str]:  # noqa: ARG003 - theirs
        """Set nothing: the simulator draws on a processor, whatever the mode."""
        return {}

    def get_tasks(self) -> list[dict[str, Any]]:
        """Return the episodes; `suite` is the task, so that a YAML's `tasks` can name it."""
        return [
            {"name": name, "suite": unit.key.task, "instruction": unit.payload.instruction}
            for name, unit in self.world.units.items()
        ]

    def get_metadata(self) -> dict[str, Any]:
        """Return the most steps of an episode; a task that allows fewer ends its own earlier."""
        return {"max_steps": self.world.max_steps}

    def get_metric_keys(self) -> dict[str, str]:
        """Return what is averaged: success, reward, last distance from hand to target (metres)."""
        return {"success": "mean", "reward": "mean", "distance": "mean"}

    def get_action_spec(self) -> dict[str, specs.DimSpec]:
        """Return what the seven numbers are: base's frame, x forward, y left, z up."""
        metres, radians = float(self._scales[0]), float(self._scales[-1])
        return {
            "position": replace(specs.POSITION_DELTA, description=f"1 is {metres:g} m"),
            "rotation": replace(
                specs.ROTATION_EULER, range=(-1, 1), description=f"1 is {radians:g} radians"
            ),
            "gripper": replace(specs.GRIPPER_CLOSE_POS, description="above 0 closes, else opens"),
        }

    def get_observation_spec(self) -> dict[str, specs.DimSpec]:
        """Return what a model is shown."""
        spec = {"image": specs.IMAGE_RGB, "language": specs.LANGUAGE}
        if self._wrist:
            spec["wrist"] = specs.IMAGE_RGB
        if self._state:
            spec["state"] = specs.STATE_EEF_POS_EULER_GRIP
        return spec

    def reset(self, task: dict[str, Any]) -> ArmView:
        """Begin an episode; what `ArmWorld.reset` raises is recorded by vla-eval."""
        return self.world.reset(task["name"])

    def step(self, action: dict[str, Any]) -> StepResult:
        """Execute `actions`, seven numbers, or `calls`; raises UsageError for anything else."""
        view = self.world.step(self._calls_of(action) if "calls" in action else self._delta(action))
        result: dict[str, Any] = {
            "success": view.success,
            "reward": view.reward,
            "distance": view.distance,
            "ended": str(view.ended or "stopped"),
        }
        return StepResult(view, view.reward, view.ended is not None, result)

    def make_obs(self, raw_obs: ArmView, task: dict[str, Any]) -> dict[str, Any]:
        """Return what a model is shown; the state has both names that its servers look for."""
        seen = {"images": dict(raw_obs.images), "task_description": task["instruction"]}
        if self._state:
            hand = raw_obs.hand
            numbers = (*hand.position, *hand.rotation, hand.gripper, hand.gripper)
            seen["states"] = seen["state"] = np.array(numbers)
        return seen

    def get_step_result(self, step_result: StepResult) -> dict[str, Any]:
        """Return the result of an episode."""
        return step_result.info

    def cleanup(self) -> None:
        """Stop the simulators."""
        self.world.close()

    def _delta(self, action: dict[str, Any]) -> ArmDelta:
        numbers = np.asarray(action.get("actions", action.get("action")), dtype=np.float64)
        if numbers.shape != (7,) or not np.isfinite(numbers).all():
            raise UsageError(
                f"actions are {numbers.tolist()!r:.100}, not seven finite numbers; a model server "
                "of chunks needs chunk_size"
            )
        moved = (numbers[:-1] * self._scales).tolist()
        return ArmDelta(tuple(moved[:3]), tuple(moved[3:]), (1.0 - float(numbers[-1])) / 2)

    def _calls_of(self, action: dict[str, Any]) -> list[Call]:
        if not self._calls:
            raise UsageError("calls of AI2-THOR's are not allowed; set calls: true among params")
        return list(action["calls"])
