"""Which place an agent looks at first for an object that is at one of two.

Who remembers goes to the right one. A place is looked at when its container is opened, or when the
agent stands within reach of where the object would lie and faces it, whatever it wants there.
"""

import math
from collections.abc import Iterable, Sequence
from enum import StrEnum

from infthor_eval.formats.twins import TwinPlace
from infthor_eval.thor.view import AgentPose

_REACH = 1.5  # AI2-THOR's visibility distance, metres
_SIDEWAYS = 45.0  # of the four directions that an agent can face, exactly one faces a place


class FirstPlace(StrEnum):
    """The place that was looked at first."""

    OWN = "own"
    TWIN = "twin"
    OTHER = "other"


def first_place(
    places: tuple[TwinPlace, TwinPlace], steps: Iterable[tuple[AgentPose, str | None]]
) -> FirstPlace | None:
    """Return the first place that an agent looks at; None if it looks at none.

    Args:
        places: where the object is, and where it is in the twin.
        steps: the pose after each action, and the id of what the action opened.
    """
    for pose, opened in steps:
        if opened is not None:
            by_id = {place.receptacle: name for name, place in _named(places)}
            return by_id.get(opened, FirstPlace.OTHER)
        looked_at = [(name, place) for name, place in _named(places) if is_looked_at(pose, place)]
        if looked_at:
            return min(looked_at, key=lambda item: _bearing(pose, item[1])[0])[0]
    return None


def is_looked_at(pose: AgentPose, place: TwinPlace) -> bool:
    """Return True if an agent stands within reach of a place and faces it."""
    distance, sideways = _bearing(pose, place)
    return distance <= _REACH and sideways <= _SIDEWAYS


def apart(places: tuple[TwinPlace, TwinPlace]) -> float:
    """Return how far two places are from each other along the floor, metres."""
    one, other = places
    return math.hypot(one.x - other.x, one.z - other.z)


def _named(places: Sequence[TwinPlace]) -> Iterable[tuple[FirstPlace, TwinPlace]]:
    return zip((FirstPlace.OWN, FirstPlace.TWIN), places, strict=True)


def _bearing(pose: AgentPose, place: TwinPlace) -> tuple[float, float]:
    """Return the distance along the floor, metres, and the angle from the heading, degrees."""
    x = place.x - pose.position.x
    z = place.z - pose.position.z
    angle = (math.degrees(math.atan2(x, z)) - pose.rotation + 180) % 360 - 180
    return math.hypot(x, z), abs(angle)
