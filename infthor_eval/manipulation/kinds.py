"""What episodes of an arm are about."""

from enum import StrEnum

__all__ = ["KIND_NAMES", "ManipulationKind"]


class ManipulationKind(StrEnum):
    """What an episode is about."""

    PICKUP = "pickup"
    PUT = "put"


KIND_NAMES = {ManipulationKind.PICKUP: "Pick-up", ManipulationKind.PUT: "Put"}  # as the paper calls them
