"""An environment with the episodes of one trajectory, which begin in the expert's true states.

To add or change when an episode of an arm begins and succeeds: here; copying its scene to the arm's
simulator is in `infthor_eval/thor/transfer.py`.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.containment import is_in
from infthor_eval.manipulation.conversion import Call, Conversion
from infthor_eval.manipulation.expert import EpisodeStart
from infthor_eval.manipulation.geometry import (
    distance_to,
    interpolate,
    middle_of,
    offset,
    point_of,
    size_of,
    xyz,
)
from infthor_eval.manipulation.kinds import Closing, Hand, ManipulationKind, Senses, Stand
from infthor_eval.manipulation.records import ArmEnded
from infthor_eval.manipulation.senses import look, observe
from infthor_eval.manipulation.trajectories import ArmEpisode
from infthor_eval.thor.frames import FrameKeeper
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.transfer import transfer
from infthor_eval.thor.view import (
    AgentPose,
    ArmState,
    SimulatorView,
    ThorObject,
    Vector,
    teleport_call,
)
from model_adapters import ArmDelta, ArmObservation

Step = ArmDelta | Sequence[Call]  # of a policy, or calls of AI2-THOR's
SUCCESS_RULES = 1  # part of a run's identity: another number when the code gives other successes
_MAX_WAITS = 20  # until a released object lies still
_HALVINGS = 8  # of the range of heights, to half a centimetre
_HELD_GAP = 0.02  # metres between the palm and an object that is held before it
_N_SHARES = 5  # of the way from there to the centre of the sphere, at which it is tried


@dataclass(frozen=True)
class Grasp:
    """How an episode begins, and how the hand closes and opens in it.

    Attributes:
        stand: where the agent stands at the start.
        hand: where its hand is at the start of a pick-up.
        closing: when a policy's hand closes in a pick-up.
        radius: radius of its sphere, metres.
        takes_all: whether it takes everything in the sphere, or the target alone.
        at_palm: whether the object to put is held before the palm, or in the centre of the sphere
            if there is room.
        threshold: value of a policy's gripper below which the hand closes; else it opens.
    """

    radius: float = 0.5
    takes_all: bool = False
    at_palm: bool = False
    threshold: float = 0.5
    stand: Stand = Stand.EXPERT
    hand: Hand = Hand.REST
    closing: Closing = Closing.ASKED


@dataclass(frozen=True)
class ArmOutcome:
    """The result of a step.

    Attributes:
        view: the world after it.
        observation: what a policy is told; None if frames are not kept.
        calls: calls of the simulator.
        refusals: messages of the simulator on calls that it refused (collisions, an empty grasp).
        distance: metres from the centre of the hand's sphere to the target's box.
        ended: how the episode ended with it; None if it goes on.
    """

    view: SimulatorView
    observation: ArmObservation | None
    calls: tuple[Call, ...] = ()
    refusals: tuple[str, ...] = ()
    distance: float = 0.0
    ended: ArmEnded | None = None


class ArmEnvironment:
    """The episodes of one trajectory.

    Attributes:
        episode: the present episode.
        start: the true state before it.
        starts_inside: whether its target is in the hand's sphere at the start.
    """

    episode: ArmEpisode
    start: EpisodeStart
    starts_inside: bool

    def __init__(
        self, trajectory: Trajectory, simulator: Simulator, senses: Senses | None = None
    ) -> None:
        """Restore the scene of a trajectory in a simulator of an agent with an arm.

        Args:
            trajectory: the trajectory.
            simulator: the simulator.
            senses: what a policy is told beside its view; nothing where None.

        Raises:
            SceneError: the simulator has no such scene.
            SimulatorError: the simulator fails.
        """
        self._simulator = simulator
        self._senses = senses or Senses()
        restore(simulator, trajectory.scene)
        self._initial = simulator.mark()
        self._is_over = True

    def reset(
        self,
        episode: ArmEpisode,
        start: EpisodeStart,
        conversion: Conversion,
        grasp: Grasp,
        frames: FrameKeeper,
    ) -> ArmOutcome:
        """Bring the world to the true state before an episode; the arm rests, or holds the object.

        Raises:
            InfeasibleError: the episode's objects cannot be brought to where they were, or not into
                the hand.
            SimulatorError: the simulator fails.
        """
        self.episode = episode
        self.start = start
        self._conversion = conversion
        self._grasp = grasp
        self._frames = frames
        view = self._simulator.rewind(self._initial, exactly=True)
        missing = set(transfer(self._simulator, start.view))
        missing &= {start.object_id, start.receptacle_id}
        if missing:
            raise InfeasibleError(f"{min(map(str, missing))} cannot be brought to where it was")
        self._wanted = start.object_id
        self._target = start.view.objects[start.receptacle_id or start.object_id]
        pose = start.view.agent if grasp.stand is Stand.EXPERT else start.before_the_way
        # An agent with an arm has another height than the default one, so the expert's y is not
        # taken over.
        position = Vector(pose.position.x, view.agent.position.y, pose.position.z)
        self._require(
            teleport_call(AgentPose(position, pose.rotation, pose.horizon, view.agent.standing))
        )
        if episode.kind == ManipulationKind.PUT:
            self._put_in_hand(start.object_id, start.view)
        elif grasp.hand is not Hand.REST:
            # Where something is in the way, the arm stays as near as it comes.
            self._simulator.step(
                "MoveArmBase", y=float(grasp.hand is Hand.HIGH), returnToStart=False
            )
        view = self._require({"action": "SetHandSphereRadius", "radius": grasp.radius})
        self.starts_inside = start.object_id in arm_of(view).pickupable
        self._is_over = False
        self._n_steps = 0
        return self._outcome()

    def step(self, action: Step) -> ArmOutcome:
        """Execute one step.

        Args:
            action: step of a policy, which is converted; or calls of AI2-THOR's.

        Raises:
            RuntimeError: the episode is over, or there was no reset.
            SimulatorError: the simulator fails.
        """
        if self._is_over:
            raise RuntimeError("no episode is under way; reset the environment to one")
        calls = self._conversion.calls(action) if isinstance(action, ArmDelta) else list(action)
        refusals = self._run(calls)
        if isinstance(action, ArmDelta):
            # After the movement, as the sphere holds other objects then.
            gripper_calls = self._gripper(action)
            refusals += self._run(gripper_calls)
            calls += gripper_calls
        released = any(call["action"] == "ReleaseObject" for call in calls)
        ended = self._ending(released)
        self._is_over = ended is not None
        self._n_steps += 1
        return self._outcome(tuple(calls), tuple(refusals), ended)

    def step_within(self, action: Step, max_steps: int) -> Iterator[tuple[Step, ArmOutcome]]:
        """Execute one step of an episode of so many steps at most, and yield it with its outcome;
        after the last one a policy's hand closes, if it is to close at the end."""
        outcome = self.step(action)
        if outcome.ended is None and self._n_steps >= max_steps:
            if isinstance(action, ArmDelta) and self._closes_at_the_end:
                yield action, outcome
                action = self.closing_calls()
                outcome = self.step(action)
            outcome = replace(outcome, ended=outcome.ended or ArmEnded.LIMIT)
        yield action, outcome

    def _outcome(
        self,
        calls: tuple[Call, ...] = (),
        refusals: tuple[str, ...] = (),
        ended: ArmEnded | None = None,
    ) -> ArmOutcome:
        view = look(self._senses, self._simulator)
        seen = observe(self._senses, view, self._n_steps, self._frames)
        return ArmOutcome(view, seen, calls, refusals, self._distance(view), ended)

    @property
    def view(self) -> SimulatorView:
        """The world now."""
        return self._simulator.view

    def query(self, action: str, **arguments: Any) -> Any:
        """Return the result of a query (`GetSpawnCoordinatesAboveReceptacle`); None if refused."""
        answer = self._simulator.query(action, **arguments)
        return answer.result if answer.success else None

    def _run(self, calls: Iterable[Call]) -> list[str]:
        """Execute calls; return the messages on those that are refused."""
        views = [self._simulator.step(**call) for call in calls]
        return [view.error or "refused without a message" for view in views if not view.success]

    def _gripper(self, delta: ArmDelta) -> list[Call]:
        """Return the calls of the gripper: it closes around something, or releases what it has."""
        arm = arm_of(self._simulator.view)
        picks_up = self.episode.kind == ManipulationKind.PICKUP
        if picks_up and self._grasp.closing is not Closing.ASKED:
            return self.closing_calls() if self._grasp.closing is Closing.ALWAYS else []
        if delta.gripper >= self._grasp.threshold:
            return [{"action": "ReleaseObject"}] if arm.held else []
        return self.closing_calls()

    @property
    def _closes_at_the_end(self) -> bool:
        """Whether a policy's hand closes once, after its last step."""
        return self.episode.kind == ManipulationKind.PICKUP and self._grasp.closing is Closing.END

    def closing_calls(self) -> list[Call]:
        """Return the calls that close the hand around what is in its sphere; none if nothing is."""
        arm = arm_of(self._simulator.view)
        if self._grasp.takes_all:
            return [{"action": "PickupObject"}] if arm.pickupable else []
        target = self.start.object_id
        if target not in arm.pickupable:
            return []
        return [{"action": "PickupObject", "objectIdCandidates": [target]}]

    def _ending(self, released: bool) -> ArmEnded | None:
        target = self._wanted
        if self.episode.kind == ManipulationKind.PICKUP:
            return self._taken(set(arm_of(self._simulator.view).held))
        if not released or target in arm_of(self._simulator.view).held:
            return None
        self._settle()
        is_there = is_in(target, str(self.start.receptacle_id), self._simulator.view)
        return ArmEnded.DONE if is_there else ArmEnded.ELSEWHERE

    def _taken(self, held: set[str]) -> ArmEnded | None:
        """Return how an episode ended in which the hand holds these; None if it goes on."""
        choice = self.episode.choice
        if choice is not None and choice.other in held:
            return ArmEnded.OTHER
        return ArmEnded.DONE if self._wanted in held else None

    def nears_other(self) -> bool | None:
        """Return whether the hand has, or is nearer to, the other of two things and not the one
        that is named; None if there are no two."""
        choice = self.episode.choice
        if choice is None:
            return None
        arm = arm_of(self.view)
        if (self._wanted in arm.held) != (choice.other in arm.held):
            return choice.other in arm.held
        hand = point_of(arm.sphere_center)
        named, other = (
            distance_to(hand, self.view.objects[key]) for key in (self._wanted, choice.other)
        )
        return other < named

    @property
    def takes_all(self) -> bool:
        """Whether the hand takes everything in its sphere."""
        return self._grasp.takes_all

    def _settle(self) -> None:
        """Wait until released objects lie still; in the embedded simulator they do at once."""
        for _ in range(_MAX_WAITS):
            if self._simulator.metadata.get("isSceneAtRest", True):
                return
            self._simulator.step("Pass")

    def _put_in_hand(self, target: str, before: SimulatorView) -> None:
        """Raise the arm to the height of the expert's hand, and have the magnet hold the object.

        The object is held in the centre of the sphere, or as near to it as there is room on the way
        from the palm.
        """
        height = before.objects[target].position.y
        low, high = 0.0, 1.0
        # By bisection: `MoveArmBase` takes a share of the range of heights, which simulators do not
        # report.
        for _ in range(_HALVINGS):
            share = (low + high) / 2
            view = self._simulator.step("MoveArmBase", y=share)
            low, high = (share, high) if arm_of(view).wrist.y < height else (low, share)
        view = self._require({"action": "SetHandSphereRadius", "radius": self._grasp.radius})
        numerators = [0] if self._grasp.at_palm else range(_N_SHARES, -1, -1)
        calls = [
            _teleport_to_hand(view.objects[target], arm_of(view), numerator / _N_SHARES)
            for numerator in numerators
        ]
        if not any(self._simulator.step(**call).success for call in calls):
            self._require(calls[-1] | {"forceAction": True})
        self._require({"action": "PickupObject", "objectIdCandidates": [target]})

    def _require(self, call: Call) -> SimulatorView:
        view = self._simulator.step(**call)
        if not view.success:
            raise InfeasibleError(f"the episode cannot be begun: {call['action']}: {view.error}")
        return view

    def _distance(self, view: SimulatorView) -> float:
        # An object that broke (an egg) is no longer listed; its last position counts.
        target = self.start.receptacle_id or self.start.object_id
        self._target = view.objects.get(target, self._target)
        return distance_to(point_of(arm_of(view).sphere_center), self._target)


def arm_of(view: SimulatorView) -> ArmState:
    """Return the agent's arm; raises InfeasibleError if its agentMode is not "arm"."""
    if view.arm is None:
        raise InfeasibleError("the simulator reports no arm; start it with agentMode arm")
    return view.arm


def _teleport_to_hand(target: ThorObject, arm: ArmState, share: float) -> Call:
    """Return the call that brings an object, turned as it is, to the palm (0) or the centre (1)."""
    wrist = point_of(arm.wrist)
    center = point_of(arm.sphere_center)
    length = math.dist(wrist, center) or 1.0
    ahead = offset(wrist, center)
    by_axis = zip(ahead, size_of(target), strict=True)
    # Half the extent of the object's box along the hand's direction.
    depth = sum(abs(part) / length * extent for part, extent in by_axis) / 2
    nearest = length - arm.sphere_radius + _HELD_GAP + depth
    goal = interpolate(wrist, center, (nearest + share * max(0.0, length - nearest)) / length)
    # The call places the object's origin, which need not be the middle of its box.
    lever = offset(middle_of(target), point_of(target.position))
    return {
        "action": "TeleportObject",
        "objectId": target.object_id,
        "position": xyz((goal[0] + lever[0], goal[1] + lever[1], goal[2] + lever[2])),
        "rotation": xyz(point_of(target.rotation)),
        "forceKinematic": True,
    }
