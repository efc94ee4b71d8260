"""Kinds of manipulation episodes, and how they begin and a hand closes in them.

What the paper does not say of its protocol can be set (docs/manipulation.md).
"""

from dataclasses import dataclass
from enum import StrEnum


class ManipulationKind(StrEnum):
    """What the arm does in an episode."""

    PICKUP = "pickup"
    PUT = "put"


# As the paper calls them.
KIND_NAMES = {ManipulationKind.PICKUP: "Pick-up", ManipulationKind.PUT: "Put"}


class Stand(StrEnum):
    """Where the agent stands at the start: where the expert does, or did before the way there."""

    EXPERT = "expert"
    BEFORE = "before"


class Closing(StrEnum):
    """When a policy's hand closes in a pick-up: if it says so, with each step, once at the end."""

    ASKED = "asked"
    ALWAYS = "always"
    END = "end"


class PutCriterion(StrEnum):
    """When a put succeeds: released wherever, or lying still in or on its receptacle."""

    RELEASE = "release"
    AT_REST = "at-rest"


class Hand(StrEnum):
    """The height of the arm's base at the start of a pick-up: at rest, the lowest, the highest."""

    REST = "rest"
    LOW = "low"
    HIGH = "high"


@dataclass(frozen=True)
class Senses:
    """What a policy with episodes is told beside its view.

    Attributes:
        wrist: whether there is a camera at the wrist, which looks where the hand points.
        state: whether it is told where its hand is, and whether it holds something.
    """

    wrist: bool = False
    state: bool = False
