"""Tuning Python's garbage collector for long loops of simulator steps."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["freeze_existing_objects"]


@contextmanager
def freeze_existing_objects() -> Iterator[None]:
    """Exempt all existing objects, which are mainly those of libraries, from garbage collection.

    Each reply of the simulator decodes to thousands of objects, which trigger collections over all
    objects again and again: 40 % of the processor time of a long loop of steps
    (`benchmarks/generation_growth.py`).
    """
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
