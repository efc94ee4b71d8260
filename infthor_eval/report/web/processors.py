"""How many processors a page may be made with."""

import os

__all__ = ["n_processors"]


def n_processors() -> int:
    """Return the processors that this process may use, which may be fewer than there are."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
