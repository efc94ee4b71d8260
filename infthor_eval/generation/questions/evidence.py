"""Choosing the frames that together show something, none of them in vain."""

from collections.abc import Callable, Mapping, Set
from typing import Any

__all__ = ["minimal_cover"]


def minimal_cover(
    wanted: Set[str], shown: Mapping[int, Set[str]], clearness: Callable[[int, Set[str]], Any]
) -> tuple[int, ...] | None:
    """A small set of frames that shows every wanted object, and from which none can be left out.

    Args:
        wanted: ids of the objects.
        shown: frame to the wanted objects that it shows.
        clearness: how well a frame shows some of them, in any form that can be compared: of frames that show as many,
            the clearest is taken.

    Returns:
        The frames in order; None where no set does.
    """
    missing = set(wanted)
    chosen: list[int] = []
    while missing:
        most = max((len(objects & missing) for objects in shown.values()), default=0)
        if not most:
            return None
        best_ones = [frame for frame in sorted(shown) if len(shown[frame] & missing) == most]
        best = max(best_ones, key=lambda frame: clearness(frame, shown[frame] & missing))
        chosen.append(best)
        missing -= shown[best]
    for frame in list(chosen):
        rest = [other for other in chosen if other != frame]
        if wanted <= set().union(*(shown[other] for other in rest)):
            chosen = rest
    return tuple(sorted(chosen))
