"""What a replay shows of an agent's step, as plain values: no simulator is needed to draw it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from infthor_eval.episodes.replay_frames import EpisodeFrame

Point = tuple[float, float]  # (x, z), metres


@dataclass(frozen=True)
class FloorPose:
    """Where an agent stands, and which way it faces: degrees from +z towards +x."""

    at: Point
    facing: float


@dataclass(frozen=True)
class MapObject:
    """An object from above: type, corners of lowest and highest x and z, and if it is named."""

    name: str
    low: Point
    high: Point
    is_named: bool = False


@dataclass(frozen=True)
class RoomMap:
    """A room from above.

    Attributes:
        floor: middles of the reachable cells, which are 0.25 m wide.
        objects: furniture, and objects that the plan names.
        goal: where the expert stood in the end of a GotoLocation plan; None for other plans.
    """

    floor: tuple[Point, ...]
    objects: tuple[MapObject, ...]
    goal: FloorPose | None = None


@dataclass(frozen=True)
class PlanObservation:
    """The world after a step.

    Attributes:
        frame: frame that the agent sees: RGB, uint8, [height, width, 3].
        walked: positions of the agent in this plan, from its start on.
        held: types of the objects in its hand.
    """

    frame: NDArray[np.uint8]
    room: RoomMap
    agent: FloorPose
    walked: tuple[Point, ...]
    held: tuple[str, ...] = ()


@dataclass(frozen=True)
class PlanTitle:
    """What a plan asks for, its number from 1, and the counts of expert's and agent's actions."""

    number: int
    n_plans: int
    text: str
    goal: str
    n_expert: int
    n_actions: int


@dataclass(frozen=True)
class PlanRewards:
    """Rewards, as the run recorded them.

    Attributes:
        step: reward of the action; None before the first one.
        plan: reward of the plan so far.
        max_of_plan: highest possible reward of the plan; None if it is not known.
        so_far: reward of the trajectory so far.
        max_so_far: highest possible reward of the trajectory up to the end of this plan.
    """

    step: float | None
    plan: float
    max_of_plan: float | None
    so_far: float
    max_so_far: float


@dataclass(frozen=True, kw_only=True)
class PlanFrame(EpisodeFrame[PlanTitle, PlanObservation]):
    """The start of a plan, or an action of it.

    Attributes:
        action: the action in words; empty if the reply could not be executed.
        reply: reply of the model if it is not the action; else empty.
        wrong: what was wrong with the action; empty if nothing was.
        goal_reached: whether the goal of the whole task was reached in the plan; set at its end
            alone.
    """

    rewards: PlanRewards
    action: str = ""
    reply: str = ""
    wrong: str = ""
    goal_reached: bool = False
