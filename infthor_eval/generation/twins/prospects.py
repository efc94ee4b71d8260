"""Which edits may give final tasks, by the episode itself, before anything is replayed."""

from collections.abc import Mapping, Sequence
from itertools import product

from msgspec.structs import replace

from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.replay import ActionReplay, ReplayReport
from infthor_eval.generation.twins.comparison import Difference
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.exchanges import Exchange
from infthor_eval.generation.twins.final_places import are_apart, place_in
from infthor_eval.generation.twins.kinds import Proposal
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import teleport_call

# Degrees of the agent, and of its camera, in looking around.
_HEADINGS = (0.0, 90.0, 180.0, 270.0)
_HORIZONS = (0.0, 30.0)
_MIN_PIXELS = 45  # of 90,000: half of what counts as shown


class Prospects:
    """Where the history of an episode may end, and what an agent that turns around sees there.

    Attributes:
        seen: ids of the objects that are seen by turning around, by the frame of each end.
    """

    def __init__(self, episode: Episode, simulator: Simulator, least_steps: int) -> None:
        """Carry the episode out, and look around after each sub-goal.

        Args:
            episode: the episode.
            simulator: a simulator.
            least_steps: actions of the shortest history.

        Raises:
            SimulatorError: the simulator fails.
        """
        self._episode = episode
        low_actions = episode.trajectory.plan.low_actions
        ends = {low.high_idx: number for number, low in enumerate(low_actions, 1)}
        report = ReplayReport(episode.trajectory.traj_id, "", "")
        replayed = ActionReplay(simulator, episode.trajectory, report)
        self.seen: Mapping[int, frozenset[str]] = {}
        seen = {}
        for number, low in enumerate(low_actions, 1):
            replayed.execute(number - 1, low)
            if number >= least_steps and number in ends.values():
                seen[number] = seen_around(simulator)
        self.seen = seen

    def may_be_needed(self, proposal: Proposal) -> bool:
        """Return whether an edit may give a final task; of other edits than exchanges, True.

        After an exchange an object is where its partner is in the episode.
        """
        if not isinstance(proposal, Exchange):
            return True
        history = self._episode.history
        return any(
            self._fits(history, end, [proposal.partner(world, obj).object_id for world in (0, 1)])
            for obj, end in product(proposal.objects, self.seen)
            if history.is_only_one(0, obj.object_id)
        )

    def hides(self, end: int, keys: Sequence[str]) -> bool:
        """Return True if an agent at the end of a history sees none of these by turning around."""
        return not self.seen.get(end, frozenset()) & set(keys)

    def _fits(self, history: TrajectoryHistory, end: int, keys: Sequence[str]) -> bool:
        if not self.hides(end, keys) or any(s.held for s in history.states(end).values()):
            return False
        fixtures = self._episode.start.objects
        try:
            one, other = (place_in(history, end, key, fixtures) for key in keys)
        except Difference:
            return False
        return are_apart((one, other), fixtures)


def seen_around(simulator: Simulator) -> frozenset[str]:
    """Return the ids of the objects that an agent sees that turns around where it stands.

    Raises:
        SimulatorError: the simulator fails.
    """
    start = simulator.view.agent
    seen: set[str] = set()
    for heading, horizon in product(_HEADINGS, _HORIZONS):
        pose = replace(start, rotation=heading, horizon=horizon)
        instances = simulator.query(**teleport_call(pose), renderImage=False).instances or {}
        seen |= {key for key, instance in instances.items() if instance.pixels >= _MIN_PIXELS}
    simulator.query(**teleport_call(start), renderImage=False)
    return frozenset(seen)
