"""What episodes of an arm are about."""

from enum import StrEnum

__all__ = ["SHORT", "ErrandKind"]


class ErrandKind(StrEnum):
    """What an episode is about."""

    PICKUP = "pickup"
    PUT = "put"


SHORT = {ErrandKind.PICKUP: "Pick-up", ErrandKind.PUT: "Put"}  # as the paper calls them
