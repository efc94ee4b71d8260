"""Where Python processes that are started look for modules: not in the folder where one stands."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock

__all__ = ["leave_safe_path", "safe_path"]

_VARIABLE = "PYTHONSAFEPATH"  # Python's -P
_CHANGING = RLock()  # the environment is of all threads


@contextmanager
def safe_path() -> Iterator[str | None]:
    """Keep the folder where one stands from Python processes that are started meanwhile.

    multiprocessing's take over `sys.path` from this process, but import modules before. Yields what
    `leave_safe_path` needs, by which what such a process starts itself is as if this one had.
    """
    with _CHANGING:
        before = os.environ.get(_VARIABLE)
        os.environ[_VARIABLE] = "1"
        try:
            yield before
        finally:
            leave_safe_path(before)


def leave_safe_path(before: str | None) -> None:
    """Have Python processes that are started from now on look for modules as before."""
    if before is None:
        os.environ.pop(_VARIABLE, None)
    else:
        os.environ[_VARIABLE] = before
