"""Episodes of one trajectory: an arm in the true state before a pick-up or put of the expert's."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.containment import is_in
from infthor_eval.manipulation.conversion import Call, Conversion
from infthor_eval.manipulation.geometry import along, away, gap, middle_of, point_of, size_of, xyz
from infthor_eval.manipulation.history import Errand, ManipulationKind, Moment, UnfitEpisodeError
from infthor_eval.manipulation.records import ArmEnded
from infthor_eval.thor.frames import FrameKeeper
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.teleport import teleport_call
from infthor_eval.thor.transfer import transfer
from infthor_eval.thor.view import AgentPose, ArmState, SimulatorView, ThorObject, Vector
from model_adapters import ArmDelta

__all__ = ["ArmEnvironment", "ArmOutcome", "Grasp", "arm_of"]

_WAITS = 20  # for what was let go to lie still
_HALVINGS = 8  # of the range of heights, to half a centimetre
_HELD_GAP = 0.02  # metres between the palm and what is held before it
_PLACES = 5  # from there to the middle of the sphere, at which there may be room


@dataclass(frozen=True)
class Grasp:
    """How a hand closes and opens.

    Attributes:
        radius: of its sphere, metres.
        takes_all: whether it takes everything in the sphere, or the target alone.
        at_palm: whether what is to be put is held before the palm, or in the middle of the sphere where there is room.
        threshold: of a policy's gripper; below it the hand closes, else it opens.
    """

    radius: float = 0.5
    takes_all: bool = False
    at_palm: bool = False
    threshold: float = 0.5


@dataclass(frozen=True)
class ArmOutcome:
    """What came of a step.

    Attributes:
        view: the world after it.
        frame: what is seen; None where nobody looks.
        calls: what the simulator was asked.
        refusals: what the simulator said of the calls that it refused (collisions, an empty grasp).
        distance: metres from the centre of the hand's sphere to the target's box.
        ended: how the episode ended with it; None where it goes on.
    """

    view: SimulatorView
    frame: FrameRef | None
    calls: tuple[Call, ...] = ()
    refusals: tuple[str, ...] = ()
    distance: float = 0.0
    ended: ArmEnded | None = None


class ArmEnvironment:
    """The episodes of one trajectory.

    Attributes:
        errand: the present one.
        moment: the true state that it began in.
        inside: whether its target lay in the hand's sphere at the start.
    """

    errand: Errand
    moment: Moment
    inside: bool

    def __init__(self, trajectory: Trajectory, simulator: Simulator) -> None:
        """Restore the scene.

        Args:
            trajectory: out of which the episodes are cut.
            simulator: of an agent with an arm.

        Raises:
            SceneError: the simulator has no such scene.
            SimulatorError: the simulator fails.
        """
        self._simulator = simulator
        restore(simulator, trajectory.scene)
        self._start = simulator.mark()
        self._over = True

    def reset(
        self, errand: Errand, moment: Moment, conversion: Conversion, grasp: Grasp, frames: FrameKeeper
    ) -> ArmOutcome:
        """Bring the world to the true state before an errand, with the arm at rest; of a put, with the object in hand.

        Args:
            errand: what is to be done.
            moment: the true state.
            conversion: of a policy's steps.
            grasp: how the hand closes.
            frames: keeps what is seen.

        Raises:
            UnfitEpisodeError: the errand's objects cannot be brought to where they were, or not into the hand.
            SimulatorError: the simulator fails.
        """
        self.errand, self.moment = errand, moment
        self._conversion, self._grasp, self._frames = conversion, grasp, frames
        view = self._simulator.rewind(self._start, exactly=True)
        lost = transfer(self._simulator, moment.view)
        named = {moment.object_id, moment.receptacle_id} & set(lost)
        if named:
            raise UnfitEpisodeError(f"{min(map(str, named))} cannot be brought to where it was")
        self._goal = moment.view.objects[moment.receptacle_id or moment.object_id]
        pose = moment.view.agent
        stand = Vector(pose.position.x, view.agent.position.y, pose.position.z)
        self._must(teleport_call(AgentPose(stand, pose.rotation, pose.horizon, view.agent.standing)))
        if errand.kind == ManipulationKind.PUT:
            self._take_in_hand(moment.object_id, moment.view)
        view = self._must({"action": "SetHandSphereRadius", "radius": grasp.radius})
        self.inside = moment.object_id in arm_of(view).pickupable
        self._over = False
        return ArmOutcome(view, self._frames.keep(view), distance=self._distance(view))

    def step(self, action: ArmDelta | Sequence[Call]) -> ArmOutcome:
        """Carry out one step.

        Args:
            action: of a policy, converted as the task says; or calls of AI2-THOR's.

        Raises:
            RuntimeError: the episode is over, or was never begun.
            SimulatorError: the simulator fails.
        """
        if self._over:
            raise RuntimeError("no episode is under way; reset the environment to one")
        movements = self._conversion.calls(action) if isinstance(action, ArmDelta) else list(action)
        calls, refusals = self._run(movements)
        if isinstance(action, ArmDelta):
            more = self._run(self._gripper(action))
            calls, refusals = [*calls, *more[0]], [*refusals, *more[1]]
        released = any(call["action"] == "ReleaseObject" for call in calls)
        ended = self._ended(released)
        self._over = ended is not None
        view = self._simulator.view
        return ArmOutcome(view, self._frames.keep(view), tuple(calls), tuple(refusals), self._distance(view), ended)

    @property
    def view(self) -> SimulatorView:
        """The world now."""
        return self._simulator.view

    def query(self, action: str, **arguments: Any) -> Any:
        """What the simulator answers to a question (`GetSpawnCoordinatesAboveReceptacle`); None where it refuses."""
        answer = self._simulator.query(action, **arguments)
        return answer.result if answer.success else None

    def _run(self, calls: Iterable[Call]) -> tuple[list[Call], list[str]]:
        done, refusals = [], []
        for call in calls:
            view = self._simulator.step(**call)
            done.append(call)
            if not view.success:
                refusals.append(view.error or "refused without a message")
        return done, refusals

    def _gripper(self, delta: ArmDelta) -> list[Call]:
        """What the gripper does after the movement: it closes around something, or lets go of what it holds."""
        arm = arm_of(self._simulator.view)
        if delta.gripper >= self._grasp.threshold:
            return [{"action": "ReleaseObject"}] if arm.held else []
        if self._grasp.takes_all:
            return [{"action": "PickupObject"}] if arm.pickupable else []
        target = self.moment.object_id
        return [{"action": "PickupObject", "objectIdCandidates": [target]}] if target in arm.pickupable else []

    def _ended(self, released: bool) -> ArmEnded | None:
        target = self.moment.object_id
        if self.errand.kind == ManipulationKind.PICKUP:
            return ArmEnded.DONE if target in arm_of(self._simulator.view).held else None
        if not released or target in arm_of(self._simulator.view).held:
            return None
        self._settle()
        there = is_in(target, str(self.moment.receptacle_id), self._simulator.view)
        return ArmEnded.DONE if there else ArmEnded.ELSEWHERE

    def _settle(self) -> None:
        """Wait until what was let go lies still; in the embedded simulator it does at once."""
        for _ in range(_WAITS):
            if self._simulator.metadata.get("isSceneAtRest", True):
                return
            self._simulator.step("Pass")

    def _take_in_hand(self, target: str, before: SimulatorView) -> None:
        """Raise the arm to where the expert's hand was, and have the magnet hold the object.

        It is held before the palm, or in the middle of the sphere: as near to that as there is room on the way to it.
        """
        height = before.objects[target].position.y
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):  # the range of heights is the simulator's, so the share is sought
            share = (low + high) / 2
            view = self._simulator.step("MoveArmBase", y=share)
            low, high = (share, high) if arm_of(view).wrist.y < height else (low, share)
        view = self._must({"action": "SetHandSphereRadius", "radius": self._grasp.radius})
        parts = [0] if self._grasp.at_palm else range(_PLACES, -1, -1)
        brought = [_brought(view.objects[target], arm_of(view), part / _PLACES) for part in parts]
        if not any(self._simulator.step(**call).success for call in brought):
            self._must(brought[-1] | {"forceAction": True})
        self._must({"action": "PickupObject", "objectIdCandidates": [target]})

    def _must(self, call: Call) -> SimulatorView:
        view = self._simulator.step(**call)
        if not view.success:
            raise UnfitEpisodeError(f"the episode cannot be begun: {call['action']}: {view.error}")
        return view

    def _distance(self, view: SimulatorView) -> float:
        # What broke and is no more (an egg) is where it was last.
        self._goal = view.objects.get(self.moment.receptacle_id or self.moment.object_id, self._goal)
        return gap(point_of(arm_of(view).sphere_center), self._goal)


def arm_of(view: SimulatorView) -> ArmState:
    """The arm of an agent that has one.

    Raises:
        UnfitEpisodeError: it has none; the simulator was not started with `agentMode="arm"`.
    """
    if view.arm is None:
        raise UnfitEpisodeError("the simulator tells of no arm; it must be one with agentMode arm")
    return view.arm


def _brought(item: ThorObject, arm: ArmState, share: float) -> Call:
    """The call that brings an object, as it is turned, before the palm (0), or to the middle of the sphere (1)."""
    wrist, center = point_of(arm.wrist), point_of(arm.sphere_center)
    length = math.dist(wrist, center) or 1.0
    ahead = away(wrist, center)
    depth = sum(abs(part) / length * extent for part, extent in zip(ahead, size_of(item), strict=True)) / 2
    nearest = length - arm.sphere_radius + _HELD_GAP + depth
    goal = along(wrist, center, (nearest + share * max(0.0, length - nearest)) / length)
    lever = away(middle_of(item), point_of(item.position))
    return {
        "action": "TeleportObject",
        "objectId": item.object_id,
        "position": xyz((goal[0] + lever[0], goal[1] + lever[1], goal[2] + lever[2])),
        "rotation": xyz(point_of(item.rotation)),
        "forceKinematic": True,
    }
