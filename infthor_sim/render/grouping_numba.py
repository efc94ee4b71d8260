"""Grouping of rays by the primitive that they hit, compiled by numba.

Rays of one primitive have all of its numbers in common, so that the compiler can compute several of
them at once.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, error_model="numpy")
def group(
    orders: NDArray[np.int32], n_primitives: int
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Sort the indices of `orders` (n,) by the primitive there, -1 for none.

    Returns:
        Where each primitive's group starts, and where the last one ends (n_primitives + 1,); and
        the sorted indices (n,). Those of none come before the first group.
    """
    n = len(orders)
    members = np.empty(n, dtype=np.int32)
    starts = np.zeros(n_primitives + 2, dtype=np.int64)
    if not n:
        return starts[:-1], members
    # Neighbours mostly have the same primitive, so that a count is only stored where it changes.
    first = 0
    for i in range(n):
        if orders[i] != orders[first]:
            starts[orders[first] + 2] += i - first
            first = i
    starts[orders[first] + 2] += n - first
    for k in range(n_primitives + 1):
        starts[k + 1] += starts[k]
    # Now starts[k + 1] is where the group of k starts; it moves on to its end as the group fills.
    last = orders[0]
    at = starts[last + 1]
    for i in range(n):
        if orders[i] != last:
            starts[last + 1] = at
            last = orders[i]
            at = starts[last + 1]
        members[at] = i
        at += 1
    starts[last + 1] = at
    return starts[:-1], members
