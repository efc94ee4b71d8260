"""What there is to be seen of an agent at one moment, as plain values: no simulator is needed to draw them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Moment", "PlanTitle", "Point", "Pose", "Rewards", "Room", "Sight", "Thing"]

Point = tuple[float, float]  # (x, z), metres


@dataclass(frozen=True)
class Pose:
    """Where somebody stands, and which way they face: degrees from +z towards +x."""

    at: Point
    facing: float


@dataclass(frozen=True)
class Thing:
    """An object from above.

    Attributes:
        name: its type.
        low: the corner of its box with the lowest x and z.
        high: the opposite corner.
        is_named: whether the plan is about it.
    """

    name: str
    low: Point
    high: Point
    is_named: bool = False


@dataclass(frozen=True)
class Room:
    """A room from above.

    Attributes:
        floor: middles of the cells that can be reached, 0.25 m wide.
        things: furniture, and what the plan is about.
        goal: where the expert stood in the end, of a plan to go somewhere; None for other plans.
    """

    floor: tuple[Point, ...]
    things: tuple[Thing, ...]
    goal: Pose | None = None


@dataclass(frozen=True)
class Sight:
    """The world at a moment.

    Attributes:
        frame: what the agent sees: RGB, uint8, [height, width, 3].
        room: around it.
        agent: where it stands.
        walked: where it stood in this plan, from its start up to now.
        held: types of what is in its hand.
    """

    frame: NDArray[np.uint8]
    room: Room
    agent: Pose
    walked: tuple[Point, ...]
    held: tuple[str, ...] = ()


@dataclass(frozen=True)
class PlanTitle:
    """What a plan asks for.

    Attributes:
        number: its place in the trajectory, from 1 on.
        n_plans: of the trajectory.
        text: in words.
        goal: of its task, in words.
        n_expert: how many actions the expert took.
        n_actions: how many the agent took.
    """

    number: int
    n_plans: int
    text: str
    goal: str
    n_expert: int
    n_actions: int


@dataclass(frozen=True)
class Rewards:
    """Points, as the run recorded them.

    Attributes:
        step: of the action; None before the first one.
        plan: of the plan up to now.
        most_of_plan: that the rules allow for it; None where nobody knows.
        so_far: of the trajectory up to now.
        most: that the rules allow for the trajectory up to the end of this plan.
    """

    step: float | None
    plan: float
    most_of_plan: float | None
    so_far: float
    most: float


@dataclass(frozen=True)
class Moment:
    """The start of a plan, or an action of it.

    Attributes:
        title: the plan.
        sight: the world after the action; None where the plan was never begun.
        rewards: up to now.
        number: of the action, from 1 on; 0 at the start.
        action: in words; empty where there was none that could be tried.
        reply: what the model said, where that is not the action; else empty.
        wrong: what was wrong with the action; empty where nothing was.
        ending: how the plan ended with it; empty where it goes on.
        done: whether it ended carried out.
        goal_reached: whether the whole task's goal came to hold in the plan; told at its end alone.
        note: how what was seen now differs from what was recorded; empty where it does not.
    """

    title: PlanTitle
    sight: Sight | None
    rewards: Rewards
    number: int = 0
    action: str = ""
    reply: str = ""
    wrong: str = ""
    ending: str = ""
    done: bool = False
    goal_reached: bool = False
    note: str = ""
