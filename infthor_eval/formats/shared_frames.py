"""Pictures that several trajectories of a set share, each stored once.

They are in the set's `frames/`, named by the digest of their content. `frames.txt` in a
trajectory's folder has the name of each frame's picture, a line a frame.
"""

import re
import shutil
from collections.abc import Sequence
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.reading import read_text
from infthor_eval.storage.digests import digest_of_file

__all__ = ["read_shared_frames", "store_picture", "write_frame_names"]

_PICTURES = "frames"
_NAMES = "frames.txt"
_NAME = re.compile(r"[0-9a-f]{32}")
_HINT = "make the set again"


def store_picture(root: Path, picture: Path, writer: str) -> str:
    """Copy a picture (PNG) into a set that may have it already, and return its name.

    Args:
        root: folder of the set.
        picture: the file.
        writer: who writes it; two that write at the same time have different names.
    """
    name = digest_of_file(picture)
    path = _path(root, name)
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        partial = path.with_name(f".{name}.{writer}.partial")
        shutil.copyfile(picture, partial)
        partial.replace(path)
    return name


def write_frame_names(folder: Path, names: Sequence[str]) -> None:
    """Write the names of a trajectory's pictures into its folder, in order of the frames."""
    (folder / _NAMES).write_text("".join(f"{name}\n" for name in names), encoding="utf-8")


def read_shared_frames(folder: Path, numbers: Sequence[int]) -> dict[int, FrameRef] | None:
    """Return the frames of a trajectory's folder by their numbers, or None if it has its own.

    Raises:
        DataError: a name is none of ours, or there is not one for each number.
    """
    path = folder / _NAMES
    if not path.is_file():
        return None
    names = read_text(path, _HINT).splitlines()
    wrong = next((name for name in names if not _NAME.fullmatch(name)), None)
    if wrong is not None:
        raise DataError(f"{path}: {wrong[:40]!r} is not the name of a picture; {_HINT}")
    if len(names) != len(numbers):
        raise DataError(
            f"{path}: {len(names)} names but {len(numbers)} entries in metadata.json; {_HINT}"
        )
    root = folder.parent.parent
    return {
        number: FrameRef(_path(root, name)) for number, name in zip(numbers, names, strict=True)
    }


def _path(root: Path, name: str) -> Path:
    return root / _PICTURES / f"{name}.png"
