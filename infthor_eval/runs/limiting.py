"""The items of a task that a limit selects: evenly from all trajectories, drawn by the seed."""

import random
from collections.abc import Callable, Sequence
from typing import TypeVar

T = TypeVar("T")


def spread(items: Sequence[T], cluster_of: Callable[[T], str], seed: int) -> list[int]:
    """Return an order of positions of which any beginning is spread evenly over the trajectories.

    Each round takes one item of every trajectory that has any left. The item, and the order of the
    trajectories, are drawn. A larger limit selects all items of a smaller one.
    """
    positions: dict[str, list[int]] = {}
    for position, item in enumerate(items):
        positions.setdefault(cluster_of(item), []).append(position)
    clusters = sorted(positions)
    random.Random(f"{seed}").shuffle(clusters)
    for cluster in clusters:  # each with its own seed: a further trajectory changes no other
        random.Random(f"{seed} {cluster}").shuffle(positions[cluster])
    longest = max(map(len, positions.values()), default=0)
    return [
        positions[cluster][turn]
        for turn in range(longest)
        for cluster in clusters
        if turn < len(positions[cluster])
    ]


def limit_items(
    items: Sequence[T], cluster_of: Callable[[T], str], seed: int, limit: int | None
) -> list[T]:
    """Return the items that a limit selects, in their order; all items without a limit."""
    return (
        [items[position] for position in sorted(spread(items, cluster_of, seed)[:limit])]
        if limit
        else list(items)
    )
