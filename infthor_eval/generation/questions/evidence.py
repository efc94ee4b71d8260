"""Choosing clue frames that together show some objects, without superfluous ones."""

from collections.abc import Callable, Mapping, Set
from typing import Any

__all__ = ["minimal_cover"]


def minimal_cover(
    items: Set[str], shown: Mapping[int, Set[str]], clarity: Callable[[int, Set[str]], Any]
) -> tuple[int, ...] | None:
    """Return a small set of frames that shows all objects and from which no frame can be removed.

    Args:
        items: ids of the objects.
        shown: the objects that each frame shows.
        clarity: how well a frame shows some objects, as any comparable value; among frames that
            show equally many, the clearest is chosen.

    Returns:
        The frames in order, or None if no set of frames shows all objects.
    """
    # Greedy set cover: minimum covers are NP-hard, and the checker only demands that no clue can be
    # removed.
    missing = set(items)
    chosen: list[int] = []
    while missing:
        most = max((len(objects & missing) for objects in shown.values()), default=0)
        if not most:
            return None
        candidates = [frame for frame in sorted(shown) if len(shown[frame] & missing) == most]
        best = max(candidates, key=lambda frame: clarity(frame, shown[frame] & missing))
        chosen.append(best)
        missing -= shown[best]
    for frame in list(chosen):
        rest = [other for other in chosen if other != frame]
        if items <= set().union(*(shown[other] for other in rest)):
            chosen = rest
    return tuple(sorted(chosen))
