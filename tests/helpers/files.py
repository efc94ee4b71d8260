"""Finding files of a run."""

from pathlib import Path

__all__ = ["find_one"]


def find_one(folder: Path, pattern: str) -> Path:
    """The one path below a folder that matches."""
    (path,) = folder.rglob(pattern)
    return path
