"""Where Python processes that are started look for modules: not in the folder where one stands."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock

__all__ = ["leave_safe_path", "safe_path"]

_VARIABLE = "PYTHONSAFEPATH"  # Python's -P
_CHANGING = RLock()  # the environment is of all threads


@contextmanager
def safe_path() -> Iterator[None]:
    """Keep the folder where one stands from processes that multiprocessing starts meanwhile: they
    take over this one's `sys.path`, but import modules before."""
    if sys.flags.safe_path:  # which multiprocessing passes on
        yield
        return
    with _CHANGING:
        os.environ[_VARIABLE] = "1"
        try:
            yield
        finally:
            leave_safe_path()


def leave_safe_path() -> None:
    """Have what this process starts look for modules as if it had not been started in it."""
    if "-P" not in sys.orig_argv:
        os.environ.pop(_VARIABLE, None)
