"""The simulators of episodes of arms: the expert's, and those with an arm, by their camera."""

from collections.abc import Callable, Iterable

from infthor_eval.episodes.retries import with_retries
from infthor_eval.episodes.simulators import Simulators
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.manipulation.expert import ExpertStates, replay_expert
from infthor_eval.manipulation.task import ArmTaskSettings


class ArmSimulators:
    """Lends the simulators that the episodes of tasks need.

    Attributes:
        all: every kind of them, to be closed by who made this.
    """

    def __init__(
        self,
        create: Callable[..., Simulators],
        settings: Iterable[ArmTaskSettings],
        *,
        image: bool,
    ) -> None:
        """Take what makes simulators with further options, the tasks, and whether arms see."""
        self._experts = create(image=False, instances=False)
        by_camera = {task.camera: task.camera_options for task in settings}
        self._arms = {
            camera: create(image=image, instances=False, agentMode="arm", **options)
            for camera, options in by_camera.items()
        }
        self.all = [self._experts, *self._arms.values()]

    def with_arm(self, settings: ArmTaskSettings) -> Simulators:
        """Return those with an arm and a task's camera."""
        return self._arms[settings.camera]

    def expert_states(self, trajectory: Trajectory) -> tuple[ExpertStates, tuple[str, ...]]:
        """Return the true states of a trajectory, and the faults on the way.

        Raises:
            SceneError: the simulator has no such scene.
            SimulatorError: the simulator fails again and again.
        """
        with self._experts.one() as expert:
            return with_retries(expert, lambda: replay_expert(trajectory, expert), lambda: None)
