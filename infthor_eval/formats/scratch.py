"""Temporary folders that do not outlast the process that made them for long, however it ended."""

import fcntl
import shutil
import tempfile
from functools import cache
from pathlib import Path
from types import TracebackType

__all__ = ["ScratchFolder"]

_PREFIX = "infthor-"
_LOCK = ".lock"


class ScratchFolder:
    """A temporary folder, locked for as long as it is used; as a context manager it gives its path.

    A process that is killed cannot remove its folders: the first folder that another one makes removes those that
    nobody holds any more. The system lets go of a lock with the process, whatever its number or container.

    Attributes:
        path: the folder, empty at first.
    """

    def __init__(self) -> None:
        """Make it.

        Raises:
            OSError: there is no room, or no place for temporary files.
        """
        _remove_abandoned(Path(tempfile.gettempdir()))
        self._around = tempfile.TemporaryDirectory(prefix=_PREFIX, ignore_cleanup_errors=True)
        around = Path(self._around.name)
        # Locked before it has its name: a lock file that nobody holds means that the folder is abandoned.
        self._lock = (around / "new").open("wb")
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        (around / "new").rename(around / _LOCK)
        self.path = around / "files"
        self.path.mkdir()

    def __enter__(self) -> Path:
        return self.path

    def __exit__(
        self, error_type: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.cleanup()

    def cleanup(self) -> None:
        """Remove it. Safe to call again."""
        self._around.cleanup()
        self._lock.close()


@cache
def _remove_abandoned(place: Path) -> None:
    for lock in place.glob(f"{_PREFIX}*/{_LOCK}"):
        try:
            with lock.open("rb") as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(lock.parent, ignore_errors=True)
        except OSError:  # somebody works there, or it is another user's, or just gone
            continue
