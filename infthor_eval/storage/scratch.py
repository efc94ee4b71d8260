"""Temporary folders that are removed even if the process that created them is killed."""

import fcntl
import shutil
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

__all__ = ["ScratchFolder", "remove_abandoned"]

_PREFIX = "infthor-"
_LOCK = ".lock"


class ScratchFolder:
    """A temporary folder, locked as long as it is in use; as a context manager it returns its path.

    A killed process cannot remove its folders. Each command (`remove_abandoned`), and the first
    scratch folder of another process, removes all folders whose lock nobody holds any more. The
    system releases a lock when its process ends, in whatever way; a process id in a file would not
    do, as containers that share the folder have the same ids.

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
        self._outer = tempfile.TemporaryDirectory(
            prefix=prefix, dir=parent, ignore_cleanup_errors=True
        )
        outer = Path(self._outer.name)
        # The file is locked before it gets the name of a lock: an unlocked one means that the
        # folder is abandoned.
        self._lock = (outer / "new").open("wb")
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        (outer / "new").rename(outer / _LOCK)
        self.path = outer / "files"
        self.path.mkdir()

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.cleanup()

    def cleanup(self) -> None:
        """Remove the folder. Calling it again does nothing."""
        self._outer.cleanup()
        self._lock.close()


def remove_abandoned() -> None:
    """Remove the system's temporary folders that killed processes left; others are in use."""
    with suppress(OSError):  # no place for temporary files, which few commands need
        _remove_abandoned(Path(tempfile.gettempdir()), _PREFIX)


@cache
def _remove_abandoned(parent: Path, prefix: str) -> None:
    for lock in parent.glob(f"{prefix}*/{_LOCK}"):
        try:
            with lock.open("rb") as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(lock.parent, ignore_errors=True)
        except OSError:  # in use, another user's, or removed by another process just now
            continue
