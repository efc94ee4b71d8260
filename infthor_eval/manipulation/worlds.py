"""Episodes of arms one at a time, for a harness that chooses them and steps through them itself.

To add a harness that drives our arms: a module in `infthor_eval/harness/` around `ArmWorld`.
"""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.episodes.retries import with_retries
from infthor_eval.errors import DataError, SceneError, SimulatorError, UsageError
from infthor_eval.manipulation.environment import ArmEnvironment, ArmOutcome, Step, arm_of
from infthor_eval.manipulation.evaluation import ArmUnit, Camera, ManipulationEvaluation
from infthor_eval.manipulation.expert import replay_expert
from infthor_eval.manipulation.options import ManipulationOptions
from infthor_eval.manipulation.records import ArmEnded
from infthor_eval.manipulation.senses import WRIST, hand_state
from infthor_eval.manipulation.suite import ManipulationSuite
from infthor_eval.runs import Catalog, TaskRequest
from infthor_eval.thor.frames import NoFrames
from model_adapters import HandState


@dataclass(frozen=True)
class ArmView:
    """What a harness is told after a reset or a step.

    Attributes:
        images: RGB pictures, [height, width, 3]: "agentview", then "wrist" where it is asked for.
        hand: the hand.
        distance: metres from the centre of the hand's sphere to the target's box.
        ended: how the episode ended; None if it goes on.
        success: whether that is a success.
        reward: the task's reward of a success, else 0.
    """

    images: Mapping[str, NDArray[np.uint8]]
    hand: HandState
    distance: float
    ended: ArmEnded | None = None
    success: bool = False
    reward: float = 0.0


def arm_evaluation(
    task: str, data: str | None = None, limit: int | None = None, cameras: str = "front"
) -> ManipulationEvaluation:
    """Return the episodes that `infthor-eval --tasks TASK --data DATA --limit LIMIT` would run.

    Args:
        task: names of tasks or groups, separated by commas.
        data: file or folder of trajectories; None for tasks that bring theirs.
        limit: number of episodes of each task; None for all.
        cameras: "front" or "front,wrist".

    Raises:
        UsageError: a name or value is not known, or the task is not one of arms.
        DataError: a trajectory cannot be read.
    """
    if limit is not None and limit < 1:
        raise UsageError(f"limit must be at least 1, not {limit}")
    files = Catalog.find_installed().expand(task.split(","))
    others = [file.name for file in files if file.suite != ManipulationSuite.name]
    if others:
        raise UsageError(f"{others[0]} is no task of an arm; `infthor-eval ls tasks` lists those")
    options = ManipulationOptions(cameras=cameras)
    place = Path(data) if data else None
    evaluation = ManipulationEvaluation(TaskRequest(files, options, place, limit))
    for checked in evaluation.tasks.values():
        if checked.tells_history:
            raise UsageError(f"{checked.name} is about frames before it, which no harness is told")
        for path, reason in checked.trajectories.broken:
            raise DataError(f"{path} cannot be used ({reason}); mend it or take it out")
    return evaluation


class ArmWorld:
    """The world of one episode after the other, each from its true state.

    Attributes:
        units: the episodes by name, TASK/TRAJECTORY/ACTION, those of a trajectory together.
        settings: settings of the tasks by name.
    """

    def __init__(self, evaluation: ManipulationEvaluation) -> None:
        """Take the episodes; simulators start when they are needed."""
        ordered = sorted(
            evaluation.units, key=lambda unit: (unit.cluster, unit.episode.index, unit.key)
        )
        self.units = {f"{unit.key.task}/{unit.key.id}": unit for unit in ordered}
        self.settings = {name: task.settings for name, task in evaluation.tasks.items()}
        self._senses = evaluation.options.senses
        self._experts = evaluation.simulators(image=False, instances=False)
        self._arms = evaluation.arm_simulators(image=True)
        self._lent = ExitStack()
        self._place: tuple[str, Camera] | None = None
        self._environment: ArmEnvironment | None = None

    @property
    def max_steps(self) -> int:
        """Most steps of an episode of any of the tasks."""
        return max(settings.max_steps for settings in self.settings.values())

    @property
    def environment(self) -> ArmEnvironment:
        """The environment of the present episode; RuntimeError if there is none."""
        if self._environment is None:
            raise RuntimeError("no episode is under way; reset the world to one")
        return self._environment

    def reset(self, name: str) -> ArmView:
        """Begin the episode of a name.

        Raises:
            InfeasibleError: it cannot begin here, so that it does not count.
            SimulatorError: the simulator fails again and again.
        """
        self._unit = self.units[name]
        self._settings = self.settings[self._unit.key.task]
        try:
            self._enter(self._unit)
            outcome, _ = with_retries(self._simulator, self._begin, self._drop_environment)
        except SceneError as error:
            raise InfeasibleError(str(error)) from error
        return self._view(outcome)

    def step(self, action: Step) -> ArmView:
        """Execute a step of a policy, or calls of AI2-THOR's; the last that the task allows ends
        the episode.

        Raises:
            RuntimeError: no episode is under way.
            SimulatorError: the simulator fails, and with it the episode.
        """
        environment = self.environment
        try:
            *_, (_, outcome) = environment.step_within(action, self._settings.max_steps)
        except SimulatorError:
            self._drop_environment()
            raise
        return self._view(outcome)

    def close(self) -> None:
        """Stop all simulators; safe to call again."""
        self._leave()
        with ExitStack() as stack:
            for simulators in (self._experts, *self._arms.values()):
                stack.callback(simulators.close)

    def _enter(self, unit: ArmUnit) -> None:
        """Borrow a simulator for the episode's trajectory, unless it is the last one's."""
        place = unit.cluster, self._settings.camera
        if self._place == place:
            return
        self._leave()
        trajectory = unit.trajectory.data
        with self._experts.one() as expert:
            self._states, _ = with_retries(
                expert, lambda: replay_expert(trajectory, expert), lambda: None
            )
        self._simulator = self._lent.enter_context(self._arms[self._settings.camera].one())
        self._place = place

    def _leave(self) -> None:
        self._place = None
        self._drop_environment()
        self._lent.close()

    def _drop_environment(self) -> None:
        self._environment = None

    def _begin(self) -> ArmOutcome:
        if self._environment is None:
            self._environment = ArmEnvironment(
                self._unit.trajectory.data, self._simulator, self._senses
            )
        episode = self._unit.episode
        start = self._states.before(episode)
        how = self._settings.conversion, self._settings.grasp
        return self._environment.reset(episode, start, *how, NoFrames())

    def _view(self, outcome: ArmOutcome) -> ArmView:
        view = outcome.view
        assert view.frame is not None  # the simulator renders
        images = {"agentview": view.frame}
        if self._senses.wrist:
            images["wrist"] = view.third_party[WRIST]
        hand = hand_state(arm_of(view))
        success = msgspec.structs.replace(self._unit.payload, ended=outcome.ended or "").done
        reward = self._settings.reward if success else 0.0
        return ArmView(images, hand, outcome.distance, outcome.ended, success, reward)
