"""Files and folders that are there whole or not at all."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["written_atomically"]


@contextmanager
def written_atomically(path: Path) -> Iterator[Path]:
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
