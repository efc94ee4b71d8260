"""What drives an arm: it begins an episode, and gives steps until the episode is over."""

import math
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from infthor_eval.errors import ModelError
from infthor_eval.formats.blank import blank_like
from infthor_eval.formats.frames import FrameRef
from infthor_eval.manipulation.conversion import Call
from infthor_eval.manipulation.environment import ArmEnvironment
from infthor_eval.manipulation.history import ManipulationKind
from infthor_eval.manipulation.reaching import plan
from infthor_eval.runs.baseline import BaselineSubject
from model_adapters import ArmDelta, Capabilities, Policy, Subject

__all__ = ["BASELINES", "ArmActor", "ArmBaseline", "ArmSituation", "PolicyActor"]

Step = ArmDelta | Sequence[Call]
_IN_FLIGHT = 2  # episodes at a time; each has two simulators of its own
_N_NUMBERS = 7  # of a policy's step
_LARGEST_TURN = 0.17  # radians of a random turn about each axis: 10 degrees


@dataclass(frozen=True)
class ArmSituation:
    """An episode that is begun.

    Attributes:
        environment: brought to it.
        instruction: what is to be done, in words.
        seed: for whatever is random in it.
        max_step: length of the longest movement, metres.
    """

    environment: ArmEnvironment
    instruction: str
    seed: str
    max_step: float


class ArmActor(Protocol):
    """Drives an arm through one episode after the other."""

    def begin(self, situation: ArmSituation) -> None:
        """An episode begins."""
        ...

    def act(self, frame: FrameRef | None) -> Sequence[Step]:
        """The next steps, to be carried out in order; none to give up.

        Raises:
            ModelError: a policy cannot act, or what it gives is no movement.
            DataError: the frame cannot be read.
        """
        ...


@runtime_checkable
class ArmBaseline(Subject, Protocol):
    """What drives an arm without looking."""

    def arm_actor(self) -> ArmActor:
        """An actor of one trajectory."""
        ...


class PolicyActor:
    """A vision-language-action policy."""

    def __init__(self, policy: Policy, *, blank: bool) -> None:
        """Say whether it is to see frames that show nothing."""
        self._policy, self._blank = policy, blank

    def begin(self, situation: ArmSituation) -> None:
        """See `ArmActor`."""
        self._instruction = situation.instruction
        self._policy.reset()

    def act(self, frame: FrameRef | None) -> Sequence[Step]:
        """See `ArmActor`."""
        assert frame is not None  # as wherever a policy looks
        chunk = self._policy.act(blank_like(frame) if self._blank else frame, self._instruction)
        if not chunk:
            raise ModelError(f"{self._policy.name} gives no movement; a policy gives at least one")
        for step in chunk:
            _check(step)
        return chunk


def _check(step: object) -> None:
    """Refuse what a policy should not give.

    Raises:
        ModelError: it is not three lengths, three angles and a gripper, all finite numbers.
    """
    if not isinstance(step, ArmDelta):
        raise ModelError(f"the policy gives {step!r:.60} for a step; it takes an ArmDelta")
    numbers = (*step.translation, *step.rotation, step.gripper)
    if (len(step.translation), len(step.rotation)) != (3, 3):
        raise ModelError(f"the policy gives {len(numbers)} numbers for a step; it takes {_N_NUMBERS}")
    try:
        finite = all(math.isfinite(number) for number in numbers)
    except TypeError:
        finite = False
    if not finite:
        raise ModelError("the policy gives numbers that are not finite; its weights or its input are broken")


class _Baseline(BaselineSubject):
    """What the baselines of arms have in common."""

    capabilities = Capabilities(counts_tokens=False, token_ids=False, max_in_flight=_IN_FLIGHT)


class _StillActor:
    def begin(self, situation: ArmSituation) -> None:
        environment = situation.environment
        pickup = environment.errand.kind == ManipulationKind.PICKUP
        take: Call = {"action": "PickupObject", "objectIdCandidates": [environment.moment.object_id]}
        self._left: list[Step] = [[take if pickup else {"action": "ReleaseObject"}]]

    def act(self, frame: FrameRef | None) -> Sequence[Step]:
        return [self._left.pop()] if self._left else []


class _RandomActor:
    def begin(self, situation: ArmSituation) -> None:
        self._draw, self._longest = random.Random(situation.seed), situation.max_step

    def act(self, frame: FrameRef | None) -> Sequence[Step]:
        x, y, z = (self._draw.uniform(-self._longest, self._longest) for _ in range(3))
        roll, pitch, yaw = (self._draw.uniform(-_LARGEST_TURN, _LARGEST_TURN) for _ in range(3))
        return [ArmDelta((x, y, z), (roll, pitch, yaw), self._draw.random())]


class _PlannerActor:
    def begin(self, situation: ArmSituation) -> None:
        self._steps = plan(situation.environment)

    def act(self, frame: FrameRef | None) -> Sequence[Step]:
        following = next(self._steps, None)
        return [] if following is None else [following]


class Still(_Baseline):
    """Closes its hand, or opens it, where it is: what is reached without moving."""

    name = "still"

    def arm_actor(self) -> ArmActor:
        """See `ArmBaseline`."""
        return _StillActor()


class RandomArm(_Baseline):
    """Moves and turns at random, and closes and opens its hand by chance."""

    name = "random-arm"

    def arm_actor(self) -> ArmActor:
        """See `ArmBaseline`."""
        return _RandomActor()


class PlannerArm(_Baseline):
    """Knows where everything is, and goes straight there by inverse kinematics: the upper bound."""

    name = "planner-arm"

    def arm_actor(self) -> ArmActor:
        """See `ArmBaseline`."""
        return _PlannerActor()


BASELINES: Mapping[str, Callable[[int], ArmBaseline]] = {made.name: made for made in (PlannerArm, RandomArm, Still)}
