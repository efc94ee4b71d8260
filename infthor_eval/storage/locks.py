"""Locks between processes: one of them writes a path, the others wait or are told."""

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from infthor_eval.errors import UsageError

_RETRY_S = 0.05  # between two attempts


@contextmanager
def hold_lock(path: Path, what: Path, wait_s: float = 0.0) -> Iterator[None]:
    """Hold the lock of a file that exists only meanwhile; a killed process holds none.

    Args:
        path: the lock's file, in an existing folder.
        what: what is written meanwhile, for the message.
        wait_s: how long another process may hold it, seconds.

    Raises:
        UsageError: another process holds it.
        OSError: the file cannot be created, or its file system has no locks.
    """
    deadline = time.monotonic() + wait_s
    while (file := _try_lock(path)) is None:
        if time.monotonic() >= deadline:
            raise UsageError(f"{what}: another process is writing it; wait for it or stop it")
        time.sleep(_RETRY_S)
    with file:
        try:
            yield
        finally:
            path.unlink(missing_ok=True)  # before it is released, as it may be another's then


def _try_lock(path: Path) -> BinaryIO | None:
    """Return the locked file, or None if another process holds or has just removed it."""
    file = path.open("ab")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.path.samestat(path.stat(), os.fstat(file.fileno())):
            return file
    except (BlockingIOError, FileNotFoundError):
        file.close()
        return None
    except OSError:
        file.close()
        raise
    file.close()
    return None
