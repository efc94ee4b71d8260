"""Pictures that several trajectories of a set share, each stored once.

They are in the set's `frames/`, named by the digest of their content. `frames.txt` in a
trajectory's folder has the name of each frame's picture, a line a frame. Patches that are laid over
it follow in the same line, the lowest first: `NAME NAME@LEFT,TOP`. The file may be packed, as
`frames.txt.xz`.
"""

import re
import shutil
from collections.abc import Sequence
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef, Patch
from infthor_eval.formats.reading import find_packed, read_text
from infthor_eval.storage.digests import digest, digest_of_file
from infthor_eval.storage.files import write_packed

_PICTURES = "frames"
_NAMES = "frames.txt"
_NAME = re.compile(r"[0-9a-f]{32}")
_LAYER = re.compile(rf"({_NAME.pattern})@(\d{{1,5}}),(\d{{1,5}})")
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


def store_encoded(root: Path, content: bytes) -> str:
    """Write a picture (PNG) into a set that no other process writes; return its name."""
    name = digest(content)
    path = _path(root, name)
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content)
    return name


def patched_name(below: str, patch: str, left: int, top: int) -> str:
    """Return the name of a picture, patched or not, with one more patch over it."""
    return f"{below} {patch}@{left},{top}"


def write_frame_names(folder: Path, names: Sequence[str], *, packed: bool = False) -> None:
    """Write the names of a trajectory's pictures into its folder, in order of the frames."""
    content = "".join(f"{name}\n" for name in names).encode()
    if packed:
        write_packed(folder / _NAMES, content)
    else:
        (folder / _NAMES).write_bytes(content)


def read_shared_frames(
    folder: Path, numbers: Sequence[int], known: dict[str, FrameRef]
) -> dict[int, FrameRef] | None:
    """Return the frames of a trajectory's folder by their numbers, or None if it has its own.

    Args:
        folder: folder of the trajectory.
        numbers: numbers of its frames, in time order.
        known: frames of other trajectories of the set by their line, which are returned where they
            are the same; those of this one are added.
    """
    path = find_packed(folder / _NAMES)
    if not path.is_file():
        return None
    root = folder.parent.parent
    lines = read_text(path, _HINT).splitlines()
    for line in lines:
        if line not in known:
            known[line] = _frame(root, path, line)
    frames = [known[line] for line in lines]
    if len(frames) != len(numbers):
        raise DataError(
            f"{path}: {len(frames)} names but {len(numbers)} entries in metadata.json; {_HINT}"
        )
    return dict(zip(numbers, frames, strict=True))


def _frame(root: Path, path: Path, line: str) -> FrameRef:
    name, *layers = line.split(" ")
    matches = [match for match in map(_LAYER.fullmatch, layers) if match is not None]
    if not _NAME.fullmatch(name) or len(matches) != len(layers):
        raise DataError(f"{path}: {line[:120]!r} is not the name of a picture; {_HINT}")
    patches = (
        Patch(_path(root, match[1]), left=int(match[2]), top=int(match[3])) for match in matches
    )
    return FrameRef(_path(root, name), tuple(patches))


def _path(root: Path, name: str) -> Path:
    return root / _PICTURES / f"{name}.png"
