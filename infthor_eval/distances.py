"""Classes of distances from a clue, in frames and in tokens, for results by distance."""

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise

# Bins double in width: they serve trajectories of hundreds and of thousands of frames alike.
_FRAMES = (0, 50, 100, 200, 400, 800, 1600, 3200)
DISTANCES = (*(f"{low}-{high - 1}" for low, high in pairwise(_FRAMES)), f">={_FRAMES[-1]}")
# Each about three times the one before: the rungs at which twins are asked.
_AGES = (0, 10, 30, 100, 300, 1000, 3000)
AGES = (*(f"{low}-{high - 1}" for low, high in pairwise(_AGES)), f">={_AGES[-1]}")
# Thousand tokens.
_TOKENS = (0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)
LENGTHS = (*(f"{low}-{high}" for low, high in pairwise(_TOKENS)), f">={_TOKENS[-1]}")


def distance_class(n_frames: int) -> str:
    """Return the class of a number of frames."""
    return _class(n_frames, _FRAMES, DISTANCES)


def age_class(n_frames: int) -> str:
    """Return the class of a number of frames since something was shown."""
    return _class(n_frames, _AGES, AGES)


def length_class(n_tokens: int) -> str:
    """Return the class of a number of tokens."""
    return _class(n_tokens / 1000, _TOKENS, LENGTHS)


def _class(value: float, edges: Sequence[int], names: Sequence[str]) -> str:
    return names[bisect_right(edges, value) - 1]
