"""Settings of this process: its use of freed memory, and where its child processes look for
modules."""

import ctypes
import os
import platform
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock

_SETTINGS = (  # numbers of <malloc.h>, and bytes
    (-1, 2**28),  # M_TRIM_THRESHOLD: bytes kept at the end of the heap
    (-2, 2**26),  # M_TOP_PAD: asked for ahead; a thread's heap is not given back when it is empty
    (-3, 2**25),  # M_MMAP_THRESHOLD: least that is always asked for anew, at its highest
)
_SAFE_PATH = "PYTHONSAFEPATH"  # Python's -P
_CHANGING = RLock()  # the environment is of all threads


def tune_malloc() -> None:
    """Have glibc reuse this process's freed memory in place of returning it (mallopt(3)).

    By default glibc returns large blocks to the system and asks for them again, and the system
    clears every page. A frame of several crops lost half as much time to that as its arithmetic
    takes; a training step of the small model, up to three times as much.
    """
    if platform.libc_ver()[0] == "glibc":
        for setting in _SETTINGS:
            ctypes.CDLL(None).mallopt(*setting)


@contextmanager
def safe_path() -> Iterator[None]:
    """Keep the working directory from processes that multiprocessing starts meanwhile.

    They take over this one's `sys.path`, but import modules before.
    """
    if sys.flags.safe_path:  # which multiprocessing passes on
        yield
        return
    with _CHANGING:
        os.environ[_SAFE_PATH] = "1"
        try:
            yield
        finally:
            leave_safe_path()


def leave_safe_path() -> None:
    """Have what this process starts look for modules as if it had not been started in it."""
    if "-P" not in sys.orig_argv:
        os.environ.pop(_SAFE_PATH, None)
