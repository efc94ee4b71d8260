"""The true states in which episodes of an arm begin: before each pick-up and put of the expert."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.formats.trajectory import LowAction, Trajectory
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.trajectories import EXPERT_ACTIONS, ArmEpisode, choice_episodes
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.recorded import MissingObjectError, translate
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, SimulatorView

_WALKING = {"MoveAhead", "RotateLeft", "RotateRight", "LookUp", "LookDown"}


@dataclass(frozen=True)
class EpisodeStart:
    """The true state before an episode.

    Attributes:
        view: the world at that time.
        object_id: id of the object that is picked up or put, in this simulator.
        receptacle_id: id of the receptacle that it is put into; None for pick-ups.
        before_the_way: pose of the expert before it walked and looked to where it picks up or puts.
    """

    view: SimulatorView
    object_id: str
    before_the_way: AgentPose
    receptacle_id: str | None = None


@dataclass(frozen=True)
class ExpertStates:
    """The true states of a trajectory, up to the first expert action that this simulator refuses.

    Attributes:
        starts: states by the low-level action that follows.
        refusal: what was refused; empty if nothing was.
    """

    starts: Mapping[int, EpisodeStart]
    refusal: str = ""

    def before(self, episode: ArmEpisode) -> EpisodeStart:
        """Return the state before an episode; raises InfeasibleError if the expert is refused."""
        if episode.index not in self.starts:
            raise InfeasibleError(self.refusal)
        return self.starts[episode.index]


def replay_expert(
    trajectory: Trajectory,
    simulator: Simulator,
    see: Callable[[SimulatorView], object] = lambda _: None,
) -> ExpertStates:
    """Replay the expert with AI2-THOR's default agent; keep states before pick-ups and puts, and at
    the end for each choice between two things.

    A state is kept if the action succeeds.

    Args:
        trajectory: the trajectory.
        simulator: a simulator of that agent.
        see: called with the world at the start and after each action.
    """
    restore(simulator, trajectory.scene)
    see(simulator.view)
    grounding = Grounding(simulator.view)
    starts: dict[int, EpisodeStart] = {}
    walked_from = simulator.view.agent
    walks = False
    for number, low in enumerate(trajectory.plan.low_actions):
        before = simulator.view
        walked = walks
        walks = low.api_action.action in _WALKING
        if walks and not walked:
            walked_from = before.agent
        try:
            call = translate(low, grounding, before)
        except MissingObjectError as error:
            return ExpertStates(starts, _refusal(number, low, str(error)))
        after = simulator.step(**call)
        see(after)
        if not after.success:
            return ExpertStates(
                starts, _refusal(number, low, after.error or "refused without a message")
            )
        kind = EXPERT_ACTIONS.get(low.api_action.action)
        if kind == ManipulationKind.PICKUP:
            starts[number] = EpisodeStart(before, call["objectId"], walked_from)
        elif kind == ManipulationKind.PUT:
            starts[number] = EpisodeStart(
                before, before.inventory[0], walked_from, call["objectId"]
            )
    for episode in choice_episodes(trajectory):
        assert episode.choice is not None
        view = simulator.view
        starts[episode.index] = EpisodeStart(view, episode.choice.target, view.agent)
    return ExpertStates(starts)


def _refusal(number: int, low: LowAction, why: str) -> str:
    return f"the expert's action {number} ({low.api_action.action}) is refused here: {why}"
