"""Choosing the frames that together show something, none of them in vain."""

from collections.abc import Mapping, Set

__all__ = ["cover"]


def cover(wanted: Set[str], shown: Mapping[int, Set[str]]) -> tuple[int, ...] | None:
    """A small set of frames that shows every wanted object, and from which none can be left out.

    Args:
        wanted: ids of the objects.
        shown: frame to the wanted objects that it shows.

    Returns:
        The frames in order; None where no set does.
    """
    missing = set(wanted)
    chosen: list[int] = []
    while missing:
        best = max(sorted(shown), key=lambda frame: len(shown[frame] & missing), default=None)
        if best is None or not shown[best] & missing:
            return None
        chosen.append(best)
        missing -= shown[best]
    for frame in list(chosen):
        rest = [other for other in chosen if other != frame]
        if wanted <= set().union(*(shown[other] for other in rest)):
            chosen = rest
    return tuple(sorted(chosen))
