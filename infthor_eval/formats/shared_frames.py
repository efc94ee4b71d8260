"""Pictures that several trajectories of a set share, each stored once.

They are in the set's `frames/`, named by the digest of their content. `frames.txt` in a
trajectory's folder has the name of each frame's picture, a line a frame.
"""

import re
from collections.abc import Sequence
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.packed.paths import SetPath
from infthor_eval.formats.reading import read_text
from infthor_eval.storage.digests import digest

_PICTURES = "frames"
_NAMES = "frames.txt"
_NAME = re.compile(r"[0-9a-f]{32}")
_HINT = "make the set again"


def store_picture(root: Path, content: bytes, writer: str) -> str:
    """Write a picture (PNG) into a set that may have it already, and return its name.

    Args:
        root: folder of the set.
        content: the picture.
        writer: who writes it; two that write at the same time have different names.
    """
    name = digest(content)
    path = root / _PICTURES / f"{name}.png"
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        partial = path.with_name(f".{name}.{writer}.partial")
        partial.write_bytes(content)
        partial.replace(path)
    return name


def write_frame_names(folder: Path, names: Sequence[str]) -> None:
    """Write the names of a trajectory's pictures into its folder, in order of the frames."""
    (folder / _NAMES).write_bytes("".join(f"{name}\n" for name in names).encode())


def read_shared_frames(
    folder: SetPath, numbers: Sequence[int], known: dict[str, FrameRef]
) -> dict[int, FrameRef] | None:
    """Return the frames of a trajectory's folder by their numbers, or None if it has its own.

    Args:
        folder: folder of the trajectory.
        numbers: numbers of its frames, in time order.
        known: frames of other trajectories of the set by their name, which are returned where they
            are the same; those of this one are added.
    """
    path = folder / _NAMES
    if not path.is_file():
        return None
    pictures = folder.parent.parent / _PICTURES
    names = read_text(path, _HINT).splitlines()
    for name in names:
        if not _NAME.fullmatch(name):
            raise DataError(f"{path}: {name[:120]!r} is not the name of a picture; {_HINT}")
        if name not in known:
            known[name] = FrameRef(pictures / f"{name}.png")
    if len(names) != len(numbers):
        raise DataError(
            f"{path}: {len(names)} names but {len(numbers)} entries in metadata.json; {_HINT}"
        )
    return dict(zip(numbers, (known[name] for name in names), strict=True))
