"""Kinds of manipulation episodes."""

from enum import StrEnum

__all__ = ["KIND_NAMES", "ManipulationKind"]


class ManipulationKind(StrEnum):
    """What the arm does in an episode."""

    PICKUP = "pickup"
    PUT = "put"


KIND_NAMES = {
    ManipulationKind.PICKUP: "Pick-up",
    ManipulationKind.PUT: "Put",
}  # as the paper calls them
