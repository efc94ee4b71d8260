"""Numbers that journals and their readers take: finite, and small enough that a float holds them.

The types of records hold the limits, so that who writes a record and who reads it cannot differ.
JSON has no NaN and no infinity, and means and sums of numbers beyond these limits would fail, or be
wrong.
"""

import math
from typing import Annotated, Any

from msgspec import Meta

MOST = 2**53  # beyond it a float skips integers
MOST_REPEATS = 10_000  # each is a unit of its own, and units are listed

Count = Annotated[int, Meta(ge=0, le=MOST)]
Total = Annotated[int, Meta(ge=1, le=MOST)]  # what a count is a share of; also a number from 1
Repetition = Annotated[int, Meta(ge=1, le=MOST_REPEATS)]
Whole = Annotated[int, Meta(ge=-MOST, le=MOST)]
Number = Annotated[float, Meta(ge=-MOST, le=MOST)]
Amount = Annotated[float, Meta(ge=0, le=MOST)]  # of seconds, metres, dollars
Share = Annotated[float, Meta(ge=0, le=1)]
# Sums over many records: each is within the limits, and all together need not be.
CountSum = Annotated[int, Meta(ge=0)]
AmountSum = Annotated[float, Meta(ge=0)]


def require_number(name: str, value: Any) -> float:
    """Return what code of others gives for a number, as one that a record can hold.

    Args:
        name: what it is, for messages.
        value: the number, or anything that `float` takes.

    Raises:
        TypeError: it is no number.
        ValueError: it is no number, not finite, or beyond the limits.
        OverflowError: it is beyond what a float holds.
    """
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{name} is {number}")
    if abs(number) > MOST:
        raise ValueError(f"{name} is {number:g}; at most {MOST:g} can be averaged")
    return number
