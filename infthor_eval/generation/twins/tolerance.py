"""How nearly equal two worlds must be where nothing differs: exactly, or as Unity allows.

The embedded simulator draws the same state the same, byte by byte. Unity's physics moves things by
millimetres, and its pictures of the same state differ a little.
"""

import math
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.generation.twins.pictures import channel_differences
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import Vector

_Place = tuple[float, float, float]


@dataclass(frozen=True)
class Tolerance:
    """The largest differences of what counts as equal.

    Attributes:
        metres: distance of an object from its place in the other world.
        mean: mean difference of pictures over pixels and channels, of 255.
        level: difference of a channel, of 255, up to which a pixel is the same.
        share: share of pixels that are not the same.
    """

    metres: float = 0.0
    mean: float = 0.0
    level: int = 0
    share: float = 0.0

    def is_same_place(self, one: _Place | Vector, other: _Place | Vector) -> bool:
        """Return True if two places count as equal."""
        return math.dist(_axes(one), _axes(other)) <= self.metres

    def is_same_picture(self, one: Path, other: Path) -> bool:
        """Return True if two pictures of the same size count as equal, other bytes or not."""
        away = channel_differences(one, other)
        unlike = (away.max(axis=-1) > self.level).mean()
        return bool(away.mean() <= self.mean and unlike <= self.share)


def _axes(place: _Place | Vector) -> _Place:
    return (place.x, place.y, place.z) if isinstance(place, Vector) else place


EXACT = Tolerance()
# As many pixels may be unlike as an object that counts as shown must have. Not tried in Unity.
UNITY = Tolerance(metres=0.01, mean=1.0, level=16, share=0.001)


def tolerance_of(simulator: Simulator) -> Tolerance:
    """Return what counts as equal in a simulator, by what it is."""
    return UNITY if simulator.label == "unity" else EXACT
