"""Whether an arm that knows where everything is picks up either of two things from where it is."""

from dataclasses import dataclass

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.formats.trajectory import ExpertPlan, Scene, Trajectory
from infthor_eval.manipulation.conversion import Conversion
from infthor_eval.manipulation.environment import ArmEnvironment, Grasp
from infthor_eval.manipulation.expert import EpisodeStart
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.planner.steps import plan_steps
from infthor_eval.manipulation.records import ArmEnded
from infthor_eval.manipulation.trajectories import ArmEpisode
from infthor_eval.thor.frames import NoFrames
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView

_MOST_STEPS = 60  # of the task


@dataclass(frozen=True)
class PlannerReach:
    """Tries things with the planner, in a simulator of an agent with an arm.

    Attributes:
        launch: the simulator.
        radius: radius of the hand's sphere, metres.
    """

    launch: Launch
    radius: float = 0.1

    def __call__(self, scene: Scene, view: SimulatorView, things: tuple[str, str]) -> bool:
        """Return whether each of the things can be picked up from where the agent stands.

        Args:
            scene: start of the episode.
            view: the world now.
            things: ids of the things.
        """
        with Simulator(self.launch, image=False, instances=False, agentMode="arm") as simulator:
            environment = ArmEnvironment(Trajectory(scene, ExpertPlan([])), simulator)
            return all(self._picks_up(environment, view, thing) for thing in things)

    def _picks_up(self, environment: ArmEnvironment, view: SimulatorView, thing: str) -> bool:
        episode = ArmEpisode(0, ManipulationKind.PICKUP, object_type_of(thing))
        grasp = Grasp(radius=self.radius, takes_all=True)
        start = EpisodeStart(view, thing, view.agent)
        try:
            environment.reset(episode, start, Conversion(), grasp, NoFrames())
        except InfeasibleError:
            return False
        for number, step in enumerate(plan_steps(environment)):
            if number == _MOST_STEPS:
                return False
            if environment.step(step).ended is ArmEnded.DONE:
                return True
        return False
