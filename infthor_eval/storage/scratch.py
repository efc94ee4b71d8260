"""Temporary folders that are removed even if the process that created them is killed."""

import fcntl
import os
import tempfile
import weakref
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import BinaryIO

from infthor_eval.storage.files import remove

_PREFIX = "infthor-"
_LOCK = ".lock"  # ends the name of the file beside a folder
_TRIES = 2  # to remove what cannot be removed at once, as on a disk with a passing error


class ScratchFolder:
    """A temporary folder, locked as long as it is in use; as a context manager it returns its path.

    A killed process cannot remove its folders. Each command (`remove_abandoned`), and the first
    scratch folder of another process, removes all folders whose lock nobody holds any more. The
    system releases a lock when its process ends, in whatever way; a process id in a file would not
    do, as containers that share the folder have the same ids. The lock is a file beside the folder,
    there before it and removed after it, so that there is never a folder without one.

    Attributes:
        path: the folder, initially empty.
    """

    def __init__(self, parent: Path | None = None) -> None:
        """Create the folder.

        Args:
            parent: existing folder that it is hidden in, for files that are renamed to there; None
                for the system's folder of temporary files.

        Raises:
            OSError: there is no room, or no place for temporary files.
        """
        prefix = _PREFIX if parent is None else f".{_PREFIX}"
        parent = Path(tempfile.gettempdir()) if parent is None else parent
        _remove_abandoned(parent, prefix)
        lock, held = _new_lock(parent, prefix)
        self._cleanup = weakref.finalize(self, _release, lock, held)  # at the end at the latest
        self.path = _folder_of(lock)
        self.path.mkdir(mode=0o700)

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.cleanup()

    def cleanup(self) -> None:
        """Remove the folder. Calling it again does nothing."""
        self._cleanup()


def remove_abandoned() -> None:
    """Remove the system's temporary folders that killed processes left; others are in use."""
    with suppress(OSError):  # no place for temporary files, which few commands need
        _remove_abandoned(Path(tempfile.gettempdir()), _PREFIX)


def _new_lock(parent: Path, prefix: str) -> tuple[Path, BinaryIO]:
    """Return the path of a new file, and the file, which is locked until it is closed."""
    while True:
        descriptor, name = tempfile.mkstemp(_LOCK, prefix, parent)
        held = os.fdopen(descriptor, "wb")
        fcntl.flock(held, fcntl.LOCK_EX)
        if os.fstat(descriptor).st_nlink:
            return Path(name), held
        held.close()  # before it was locked, another process took it for abandoned


def _folder_of(lock: Path) -> Path:
    return lock.with_name(lock.name.removesuffix(_LOCK))


def _release(lock: Path, held: BinaryIO) -> None:
    _remove(lock)
    held.close()


def _remove(lock: Path) -> None:
    """Remove the folder of a lock that this process holds, and then the lock: whatever cannot be
    removed has one still."""
    for _ in range(_TRIES):
        with suppress(OSError):
            remove(_folder_of(lock))
            remove(lock)
            return


@cache
def _remove_abandoned(parent: Path, prefix: str) -> None:
    for lock in parent.glob(f"{prefix}*{_LOCK}"):
        try:
            with lock.open("r+b") as file:  # on NFS only what can be written is locked
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                _remove(lock)
        except OSError:  # in use, another user's, or removed by another process just now
            continue
