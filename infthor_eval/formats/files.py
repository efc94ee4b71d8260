"""Files and folders that are there whole or not at all, and the places where they are to go."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from infthor_eval.errors import DataError, wrap_errors

__all__ = [
    "OVERWRITE_HINT",
    "prepare_file",
    "prepare_folder",
    "refuse_overwrite",
    "require_writable",
    "write_atomically",
]

OVERWRITE_HINT = "give another --out, or --overwrite if nobody edited it"
_HINT = "make room, or give another place with"
_PROBE = b"x" * 4096  # a full disk may still take a name


def prepare_folder(path: Path, option: str = "--out") -> Path:
    """Make a folder, and see that it can be written to; called before the work, which would be lost after it.

    Args:
        path: of the folder.
        option: how users name it, for the message.

    Raises:
        DataError: it is a file, or cannot be made or written to.
    """
    require_writable(path, option)
    with wrap_errors(f"{path}: cannot be written to", f"{_HINT} {option}"):
        path.mkdir(parents=True, exist_ok=True)
    return path


def require_writable(path: Path, option: str = "--out") -> None:
    """See that a folder can be written to, or made where it is not there; nothing is left behind.

    Args:
        path: of the folder.
        option: how users name it, for the message.

    Raises:
        DataError: it cannot.
    """
    with wrap_errors(
        f"{path}: cannot be written to", f"{_HINT} {option}", catch=(OSError, ValueError)
    ):  # ValueError: a null
        there = next(folder for folder in (path, *path.absolute().parents) if _is_there(folder))
        with tempfile.TemporaryFile(dir=there) as probe:
            probe.write(_PROBE)
            probe.flush()
            os.fsync(probe.fileno())


def _is_there(path: Path) -> bool:
    """Whether there is anything; not `exists`, which takes a name that cannot be for one that is not there."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True


def prepare_file(path: Path, option: str = "--out") -> Path:
    """See that a file can be written, or replaced; called before the work.

    Args:
        path: of the file.
        option: how users name it, for the message.

    Raises:
        DataError: it is a folder, a pipe or a device, or its folder cannot be written to.
    """
    prepare_folder(path.parent, option)
    with wrap_errors(f"{path}: cannot be written to", f"{_HINT} {option}"):
        if path.exists() and not path.is_file():
            raise DataError(f"{path}: is not a file; give another place with {option}")
    return path


def refuse_overwrite(path: Path, content: bytes) -> None:
    """Refuse to replace a file by another content: somebody may have edited it.

    Args:
        path: of the file.
        content: what would be written.

    Raises:
        DataError: the file holds something else.
    """
    with wrap_errors(f"{path}: cannot be read", OVERWRITE_HINT):
        if path.is_file() and path.read_bytes() != content:
            raise DataError(f"{path}: is there already and holds something else; {OVERWRITE_HINT}")


@contextmanager
def write_atomically(path: Path) -> Iterator[Path]:
    """Write a file or a folder beside its place, and put it there when all of it is written.

    Args:
        path: the place; a file that is there is replaced, a folder must not be there.

    Yields:
        Where to write. What an earlier, killed process left there is gone; on an error nothing stays behind.

    Raises:
        OSError: it cannot be put in its place.
    """
    partial = path.with_name(f".{path.name}.partial")
    _remove(partial)
    try:
        yield partial
        partial.replace(path)
    finally:
        _remove(partial)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
