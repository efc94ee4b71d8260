"""What a replay shows of an arm at one step, as plain values: no simulator is needed to draw it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from infthor_eval.episodes.replay_frames import EpisodeFrame

# Metres to the right of the agent, ahead of it, and up in the world.
Place = tuple[float, float, float]


@dataclass(frozen=True)
class NearbyObject:
    """An object near the arm.

    Attributes:
        corners: corners of its box from above, in order: metres to the right and ahead.
        low: height of its lowest point.
        high: height of its highest point.
        is_named: whether the instruction names it.
    """

    name: str
    corners: tuple[tuple[float, float], ...]
    low: float
    high: float
    is_named: bool = False


@dataclass(frozen=True)
class Reach:
    """The arm and what is near it.

    Attributes:
        joints: joints from the base to the wrist.
        hand: centre of the hand's sphere.
        radius: radius of the sphere.
        path: centres of the sphere from the episode's start on.
        objects: objects nearby.
        low: lowest coordinates that a picture of the episode must contain.
        high: highest coordinates that it must contain.
    """

    joints: tuple[Place, ...]
    hand: Place
    radius: float
    path: tuple[Place, ...]
    objects: tuple[NearbyObject, ...]
    low: Place
    high: Place


@dataclass(frozen=True)
class ArmObservation:
    """The world after a step.

    Attributes:
        frame: frame that the agent sees: RGB, uint8, [height, width, 3].
        reach: the arm and what is near it.
        held: types of the objects in the hand.
    """

    frame: NDArray[np.uint8]
    reach: Reach
    held: tuple[str, ...] = ()


@dataclass(frozen=True)
class EpisodeTitle:
    """What an episode asks for.

    Attributes:
        number: number among the run's episodes of the trajectory, from 1 on.
        n_episodes: number of these.
        action: index of the expert's low-level action that the episode replaces.
        radius: radius of the hand's sphere, metres.
    """

    number: int
    n_episodes: int
    action: int
    kind: str
    instruction: str
    n_steps: int
    radius: float


@dataclass(frozen=True, kw_only=True)
class ArmFrame(EpisodeFrame[EpisodeTitle, ArmObservation]):
    """The start of an episode, or a step of it.

    Attributes:
        requests: request of a policy, and the simulator's calls, a line each.
        actions: names of the calls, in order.
        refusals: messages of the simulator on calls that it refused in this step.
        distance: metres from the centre of the hand's sphere to the target's box, as recorded; None
            if nobody acted.
        closest: smallest distance so far.
        n_collisions: collisions so far.
        reward: reward so far.
        max_reward: highest possible reward.
    """

    requests: tuple[str, ...] = ()
    actions: tuple[str, ...] = ()
    refusals: tuple[str, ...] = ()
    distance: float | None = None
    closest: float | None = None
    n_collisions: int = 0
    reward: float = 0.0
    max_reward: float = 0.0
