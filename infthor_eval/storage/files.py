"""Writing files and folders atomically, and checking the output paths before the work starts."""

import errno
import fcntl
import os
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.storage.digests import digest

OVERWRITE_HINT = "give another --out, or --overwrite if nobody edited it"
# Other characters, and these names with any ending, mean something to some system.
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9 _.@+-]+")
_DEVICES = re.compile(r"(?:con|prn|aux|nul|com\d|lpt\d)(?:\.|$)", re.IGNORECASE)
_LONGEST_NAME = 150  # characters; systems take 255 bytes, and endings follow
_LOCK = ".lock"
_WAIT_S = 60.0  # for another process that writes the same file
_REMEDIES: dict[int | None, str] = {
    errno.ENOSPC: "make room",
    errno.EDQUOT: "make room",
    errno.EACCES: "allow writing there",
    errno.EPERM: "allow writing there",
    errno.EROFS: "make it writable",
}
_PROBE = b"x" * 4096  # a full disk still creates an empty file, so content is written too
_RETRY_S = 0.05  # between two attempts


def file_name(text: str) -> str:
    """Return the name of a file or folder for any text; most names are their own.

    Names come from data and journals of others, which must write nothing outside an output: the
    result is one part of a path, short, and the same on every system. A hash is appended if
    anything is changed (the ids of ALFRED have a slash), so that two texts never share a name.
    """
    name = plain_name(text)
    if name == text and name:
        return name
    return f"{name}-{digest(text.encode('utf-8', 'backslashreplace'), 4)}"


def plain_name(text: str) -> str:
    """Return the part of a text that a name can have, without a hash; may be empty."""
    name = _NOT_IN_NAMES.sub("_", text).lstrip(". ")[:_LONGEST_NAME].rstrip(". ")
    return f"_{name}" if _DEVICES.match(name) else name


def prepare_folder(path: Path, option: str = "--out") -> Path:
    """Create an option's folder, and check that it is writable before results would be lost."""
    require_writable(path, option)
    with wrap_errors(f"{path}: cannot be written to", _other_place(option)):
        path.mkdir(parents=True, exist_ok=True)
    return path


@contextmanager
def hold_folder(path: Path, option: str = "--out") -> Iterator[Path]:
    """Prepare an option's folder, and keep other commands from writing into it meanwhile."""
    prepare_folder(path, option)
    with _hold_lock(path / _LOCK, path):
        yield path


def writing_hint(then: str) -> Callable[[BaseException], str]:
    """Return the hint for what cannot be written: a remedy for the error's reason, and `then`.

    Example: `writing_hint(", or give another --out")` says "make room, or give another --out" of a
    full disk, and "allow writing there, or ..." where a permission is missing.
    """

    def hint(error: BaseException) -> str:
        reason = error.errno if isinstance(error, OSError) else None
        return _REMEDIES.get(reason, "check it") + then

    return hint


def _other_place(option: str) -> Callable[[BaseException], str]:
    return writing_hint(f", or give another place with {option}")


def require_writable(path: Path, option: str = "--out") -> None:
    """Check that the folder of an option can be written to, or created; nothing is left behind."""
    catch = (OSError, ValueError)  # ValueError: a null character in the name
    with wrap_errors(f"{path}: cannot be written to", _other_place(option), catch=catch):
        nearest = next(folder for folder in (path, *path.absolute().parents) if _is_there(folder))
        with tempfile.TemporaryFile(dir=nearest) as probe:
            probe.write(_PROBE)
            probe.flush()
            os.fsync(probe.fileno())


def _is_there(path: Path) -> bool:
    # Not `Path.exists`, which returns False for names that the system refuses (too long, no
    # permission).
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True


def prepare_file(path: Path, option: str = "--out") -> Path:
    """Check that the file of an option can be written or replaced, and create its folder."""
    prepare_folder(path.parent, option)
    with wrap_errors(f"{path}: cannot be written to", _other_place(option)):
        if path.exists() and not path.is_file():
            raise DataError(f"{path}: not a file; give another place with {option}")
    return path


def refuse_overwrite(path: Path, content: bytes) -> None:
    """Refuse to replace a file by different content: somebody may have edited it."""
    with wrap_errors(f"{path}: cannot be read", OVERWRITE_HINT):
        if path.is_file() and path.read_bytes() != content:
            raise DataError(f"{path}: exists already with different content; {OVERWRITE_HINT}")


@contextmanager
def write_atomically(path: Path, known_as: str | None = None) -> Iterator[Path]:
    """Write a file or folder under a temporary name beside `path`; rename it when it is complete.

    Args:
        path: the final path; an existing file is replaced, a folder must not exist.
        known_as: name that is the same each time, if that of `path` has the time in it.

    Yields:
        The temporary path, at which nothing exists. After an error nothing remains there.

    Raises:
        UsageError: another process is writing the same path, and does not end within a minute.
        OSError: the temporary path cannot be renamed.
    """
    # The name is fixed, so that what a killed process left is found and removed by the next one.
    partial, lock = _leftovers(path, known_as or path.name)
    with _hold_lock(lock, path, _WAIT_S):
        remove(partial)
        try:
            yield partial
            partial.replace(path)  # atomic, as both are on one file system
        finally:
            remove(partial)


@contextmanager
def write_output(path: Path, hint: str | Callable[[BaseException], str]) -> Iterator[Path]:
    """Write as `write_atomically` does; what prevents it is an error of one line with this hint."""
    with wrap_errors(f"{path}: cannot be written", hint), write_atomically(path) as partial:
        yield partial


def is_written(path: Path) -> bool:
    """Return whether a path that `write_atomically` writes is there, and need not be written.

    What a killed process left beside it is removed, as no other writer would.
    """
    if not path.exists():
        return False
    partial, lock = _leftovers(path, path.name)
    if lock.exists():
        with _hold_lock(lock, path, _WAIT_S):
            remove(partial)
    return True


def _leftovers(path: Path, name: str) -> tuple[Path, Path]:
    """Return the temporary path and the lock that a killed process leaves beside `path`."""
    return path.with_name(f".{name}.partial"), path.with_name(f".{name}{_LOCK}")


def remove(path: Path) -> None:
    """Remove a file or a folder with all that is in it, if it is there."""
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


@contextmanager
def _hold_lock(path: Path, what: Path, wait_s: float = 0.0) -> Iterator[None]:
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
    with ExitStack() as opened:
        file = opened.enter_context(path.open("ab"))
        with suppress(BlockingIOError, FileNotFoundError):
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(path.stat(), os.fstat(file.fileno())):
                opened.pop_all()  # whoever holds the lock closes it
                return file
    return None
