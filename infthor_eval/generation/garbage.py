"""Long loops of simulator steps and Python's garbage collector."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["freeze_existing_objects"]


@contextmanager
def freeze_existing_objects() -> Iterator[None]:
    """Has the garbage collector pass over all that exists now, which is mainly what libraries hold.

    A reply of the simulator decodes to thousands of objects. They make the collector look through everything again
    and again: 40 % of the processor time of a long loop of steps (`benchmarks/generation_growth.py`).
    """
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
