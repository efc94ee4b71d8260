"""How an episode begins and when a hand closes: what the paper does not say of its protocol
(docs/manipulation.md)."""

from enum import StrEnum

__all__ = ["Closing", "Hand", "Stand"]


class Stand(StrEnum):
    """Where the agent stands at the start: where the expert does, or did before the way there."""

    EXPERT = "expert"
    BEFORE = "before"


class Closing(StrEnum):
    """When a policy's hand closes in a pick-up: when it says so, with each step, or once at the
    end."""

    ASKED = "asked"
    ALWAYS = "always"
    END = "end"


class Hand(StrEnum):
    """The height of the arm's base at the start of a pick-up: at rest, the lowest, the highest."""

    REST = "rest"
    LOW = "low"
    HIGH = "high"
