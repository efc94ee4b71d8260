"""Which items of a task a limit takes: evenly from all trajectories, drawn by the seed."""

import random
from collections.abc import Callable, Sequence
from typing import TypeVar

__all__ = ["limited", "spread"]

T = TypeVar("T")


def spread(items: Sequence[T], cluster_of: Callable[[T], str], seed: int) -> list[int]:
    """An order in which any beginning is spread evenly over the trajectories.

    Each round takes one item of every trajectory that has any left; which one, and which trajectory comes first, is
    drawn. What a smaller limit takes, a larger one takes too.

    Args:
        items: of one task.
        cluster_of: the trajectory of an item.
        seed: of the run.

    Returns:
        Places in `items`.
    """
    places: dict[str, list[int]] = {}
    for place, item in enumerate(items):
        places.setdefault(cluster_of(item), []).append(place)
    clusters = sorted(places)
    random.Random(f"{seed}").shuffle(clusters)
    for cluster in clusters:  # each by itself: a further trajectory changes nothing of another
        random.Random(f"{seed} {cluster}").shuffle(places[cluster])
    longest = max(map(len, places.values()), default=0)
    return [places[cluster][turn] for turn in range(longest) for cluster in clusters if turn < len(places[cluster])]


def limited(items: Sequence[T], cluster_of: Callable[[T], str], seed: int, limit: int | None) -> list[T]:
    """The items that a limit takes, in their own order; all where there is none."""
    return [items[place] for place in sorted(spread(items, cluster_of, seed)[:limit])] if limit else list(items)
