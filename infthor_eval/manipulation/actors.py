"""What drives an arm: it begins an episode, and gives steps until the episode is over.

To add a baseline of arms: a class in `BASELINES` here, and its name in `infthor_eval/suites.py`;
how `planner-arm` moves is in `planner/steps.py`.
"""

import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Protocol, runtime_checkable

from infthor_eval.formats.pictures.blank import blank_like
from infthor_eval.manipulation.conversion import Call
from infthor_eval.manipulation.environment import ArmEnvironment, Step
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.planner.steps import plan_steps
from infthor_eval.runs import StoredRequest
from infthor_eval.runs.suite import BaselineSubject
from model_adapters import (
    ArmDelta,
    ArmObservation,
    Capabilities,
    Episode,
    FramePolicy,
    Policy,
    Subject,
    with_episodes,
)
from model_adapters.refusals import check_chunk

_IN_FLIGHT = 2  # trajectories at a time; each has two simulators
_MAX_TURN = 0.17  # radians of a random turn about each axis: 10 degrees


@dataclass(frozen=True)
class ArmSituation:
    """An episode that begins in an environment reset to it.

    Attributes:
        environment: the environment.
        episode: what a policy is told of the episode.
        seed: seed of whatever an actor draws.
        max_step: longest step, metres.
    """

    environment: ArmEnvironment
    episode: Episode
    seed: str
    max_step: float


class ArmActor(Protocol):
    """Drives an arm through one episode after the other."""

    def begin(self, situation: ArmSituation) -> None:
        """Begin an episode."""

    def act(self, seen: ArmObservation | None) -> Sequence[Step]:
        """Choose the next steps, to be executed in order; an empty sequence gives up.

        Raises:
            ModelError: a policy fails, or its result is no movement.
            DataError: the frame cannot be read.
        """

    def end(self, *, success: bool | None) -> None:
        """Be told that the episode is over."""


@runtime_checkable
class ArmBaseline(Subject, Protocol):
    """A subject that drives an arm without frames."""

    def arm_actor(self) -> ArmActor:
        """Create the actor of a trajectory."""


class PolicyActor:
    """A vision-language-action policy."""

    def __init__(self, policy: Policy | FramePolicy, *, blank: bool) -> None:
        """Take a policy; `blank` shows it grey frames instead of the actual ones."""
        self._policy = with_episodes(policy)
        self._blank = blank

    def begin(self, situation: ArmSituation) -> None:
        """See `ArmActor`."""
        episode = situation.episode
        self._instruction = episode.instruction
        if self._blank:
            episode = replace(episode, history=tuple(map(blank_like, episode.history)))
        self._policy.begin(episode)

    def act(self, seen: ArmObservation | None) -> Sequence[Step]:
        """See `ArmActor`."""
        assert seen is not None  # frames are kept for policies
        chunk = self._policy.act(self._shown(seen))
        check_chunk(self._policy.name, chunk)
        return chunk

    def end(self, *, success: bool | None) -> None:
        """See `ArmActor`."""
        self._policy.end(success=success)

    def request(self, seen: ArmObservation) -> StoredRequest:
        """Return the request before the first step, as the journal has it."""
        what = "frames (blank)" if self._blank else "frames"
        shown = self._shown(seen)
        frames = (shown.image,) if shown.wrist is None else (shown.image, shown.wrist)
        return StoredRequest.of(frames, self._instruction, self._instruction, what=what)

    def _shown(self, seen: ArmObservation) -> ArmObservation:
        if not self._blank:
            return seen
        wrist = None if seen.wrist is None else blank_like(seen.wrist)
        return replace(seen, image=blank_like(seen.image), wrist=wrist)


class _BaselineActor:
    """Takes the steps that a baseline yields, one at a time."""

    def __init__(self, steps: Callable[[ArmSituation], Iterator[Step]]) -> None:
        self._steps_of = steps

    def begin(self, situation: ArmSituation) -> None:
        self._steps = self._steps_of(situation)

    def act(self, seen: ArmObservation | None) -> Sequence[Step]:
        return [*islice(self._steps, 1)]

    def end(self, *, success: bool | None) -> None:
        """Do nothing."""


class _ArmBaseline(BaselineSubject):
    capabilities = Capabilities(counts_tokens=False, token_ids=False, max_in_flight=_IN_FLIGHT)

    def arm_actor(self) -> ArmActor:
        """See `ArmBaseline`."""
        return _BaselineActor(self._steps)

    @staticmethod
    def _steps(situation: ArmSituation) -> Iterator[Step]:
        """Yield the steps of an episode; it gives up where they end."""
        raise NotImplementedError


class StillArm(_ArmBaseline):
    """Closes its hand, or opens it, where it is: what succeeds without a movement."""

    name = "still"

    @staticmethod
    def _steps(situation: ArmSituation) -> Iterator[Step]:
        environment = situation.environment
        take: Call = {"action": "PickupObject"}
        if not environment.takes_all:
            take["objectIdCandidates"] = [environment.start.object_id]
        is_pickup = environment.episode.kind == ManipulationKind.PICKUP
        yield [take if is_pickup else {"action": "ReleaseObject"}]


class RandomArm(_ArmBaseline):
    """Moves, turns, closes and opens its hand at random."""

    name = "random-arm"

    @staticmethod
    def _steps(situation: ArmSituation) -> Iterator[Step]:
        draw = random.Random(situation.seed)
        while True:
            translation = _random_vector(draw, situation.max_step)
            rotation = _random_vector(draw, _MAX_TURN)
            yield ArmDelta(translation, rotation, draw.random())


def _random_vector(draw: random.Random, most: float) -> tuple[float, float, float]:
    return draw.uniform(-most, most), draw.uniform(-most, most), draw.uniform(-most, most)


class PlannerArm(_ArmBaseline):
    """Knows where everything is, and moves there by inverse kinematics: the upper bound."""

    name = "planner-arm"

    @staticmethod
    def _steps(situation: ArmSituation) -> Iterator[Step]:
        return plan_steps(situation.environment)


BASELINES: Mapping[str, Callable[[int], ArmBaseline]] = {
    baseline.name: baseline for baseline in (PlannerArm, RandomArm, StillArm)
}
