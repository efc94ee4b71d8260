"""What there is to be seen of an arm at one moment, as plain values: no simulator is needed to draw them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["ArmMoment", "ArmSight", "EpisodeTitle", "Place", "Reach", "Solid"]

Place = tuple[float, float, float]  # metres to the right of the agent, ahead of it, and up in the world


@dataclass(frozen=True)
class Solid:
    """An object near the arm.

    Attributes:
        name: its type.
        corners: of its box from above, in order: metres to the right and ahead.
        low: height of its lowest point.
        high: height of its highest point.
        is_named: whether the instruction is about it.
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
        joints: from the base to the wrist.
        hand: middle of its sphere.
        radius: of the sphere.
        way: where the middle was, from the episode's start up to now.
        solids: what is near.
        low: the corner of what a picture of the episode must hold, with the lowest numbers.
        high: the opposite corner.
    """

    joints: tuple[Place, ...]
    hand: Place
    radius: float
    way: tuple[Place, ...]
    solids: tuple[Solid, ...]
    low: Place
    high: Place


@dataclass(frozen=True)
class ArmSight:
    """The world at a moment.

    Attributes:
        frame: what the agent sees: RGB, uint8, [height, width, 3].
        reach: the arm and what is near it.
        held: types of what is in the hand.
    """

    frame: NDArray[np.uint8]
    reach: Reach
    held: tuple[str, ...] = ()


@dataclass(frozen=True)
class EpisodeTitle:
    """What an episode asks for.

    Attributes:
        number: its place among the run's episodes of the trajectory, from 1 on.
        n_episodes: of them.
        action: the expert's low-level action that it stands for.
        kind: "Pick-up" or "Put".
        instruction: in words.
        n_steps: how many the arm took.
        radius: of the hand's sphere, metres.
    """

    number: int
    n_episodes: int
    action: int
    kind: str
    instruction: str
    n_steps: int
    radius: float


@dataclass(frozen=True)
class ArmMoment:
    """The start of an episode, or a step of it.

    Attributes:
        title: the episode.
        sight: the world after the step; None where nobody acted in the episode.
        number: of the step, from 1 on; 0 at the start.
        asked: what a policy asked for, and what the simulator was, a line each.
        actions: names of the calls, in order.
        refusals: what the simulator said of calls that it refused in this step.
        distance: metres from the middle of the hand's sphere to the target's box, as recorded; None where nobody acted.
        closest: the same at its smallest up to now.
        n_collisions: up to now.
        reward: earned up to now.
        most: that could be.
        ending: how the episode ended with it; empty where it goes on.
        done: whether it ended as a success.
        note: how what was seen now differs from what was recorded; empty where it does not.
    """

    title: EpisodeTitle
    sight: ArmSight | None
    number: int = 0
    asked: tuple[str, ...] = ()
    actions: tuple[str, ...] = ()
    refusals: tuple[str, ...] = ()
    distance: float | None = None
    closest: float | None = None
    n_collisions: int = 0
    reward: float = 0.0
    most: float = 0.0
    ending: str = ""
    done: bool = False
    note: str = ""
