"""Pictures one after the other as a file that moves: MP4 or GIF; the same pictures give the same bytes."""

import tempfile
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from PIL import Image

from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.formats.files import write_atomically

__all__ = ["ANIMATION_FORMATS", "require_animation_name", "write_animation"]

ANIMATION_FORMATS = (".mp4", ".gif")
# VP9, which browsers play, and MPEG-4 where an OpenCV lacks it. None of its wheels can encode H.264.
_CODECS = ("vp09", "mp4v")
_COLOURS = 128  # of a picture in a GIF
_HINT = "make room, or give another place with --out"


def require_animation_name(path: Path) -> None:
    """See that a file's name says in which format it is to be written.

    Raises:
        UsageError: it does not.
    """
    if path.suffix.lower() not in ANIMATION_FORMATS:
        raise UsageError(f"--out {path}: a recording is {' or '.join(ANIMATION_FORMATS)}; give a file of such a name")


def write_animation(path: Path, pictures: Iterable[Image.Image], per_second: float) -> int:
    """Write pictures; they are asked for one at a time. The file is there whole or not at all.

    Args:
        path: ends in one of `ANIMATION_FORMATS`.
        pictures: RGB, all of one even size; at least one.
        per_second: how many of them are shown in a second.

    Returns:
        How many there were.

    Raises:
        UsageError: the file's name has another ending.
        DataError: the file cannot be written.
    """
    require_animation_name(path)
    write = _write_gif if path.suffix.lower() == ".gif" else _write_mp4
    with (
        wrap_errors(f"{path}: cannot be written", _HINT),
        write_atomically(path) as partial,
        tempfile.TemporaryDirectory(dir=path.parent, prefix=".recording-") as folder,
    ):
        made = Path(folder) / f"made{path.suffix.lower()}"  # OpenCV goes by the ending, which `partial` has not
        n_pictures = write(made, pictures, per_second)
        made.replace(partial)
    return n_pictures


def _write_gif(path: Path, pictures: Iterable[Image.Image], per_second: float) -> int:
    counted = _Counted(pictures)
    reduced = (picture.quantize(_COLOURS, dither=Image.Dither.NONE) for picture in counted)
    first = next(reduced)
    duration = max(20, round(100 / per_second) * 10)  # a GIF counts in hundredths of a second
    first.save(path, save_all=True, append_images=reduced, duration=duration, loop=0, optimize=False)
    return counted.n


def _write_mp4(path: Path, pictures: Iterable[Image.Image], per_second: float) -> int:
    import cv2

    before = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(0)  # what it says of a codec that is not there, we say
    counted = _Counted(pictures)
    rest = iter(counted)
    first = next(rest)
    try:
        video = _opened(path, first.size, per_second)
        for picture in chain([first], rest):
            video.write(np.asarray(picture)[:, :, ::-1])
        video.release()
        kept = int(cv2.VideoCapture(str(path)).get(cv2.CAP_PROP_FRAME_COUNT))
    finally:
        cv2.utils.logging.setLogLevel(before)
    if kept != counted.n:  # OpenCV does not say when a disk is full
        raise DataError(f"{path.parent}: only {kept} of {counted.n} pictures could be written; {_HINT}")
    return counted.n


def _opened(path: Path, size: tuple[int, int], per_second: float):  # type: ignore[no-untyped-def]  # cv2 has no types
    import cv2

    for codec in _CODECS:
        video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), per_second, size)
        if video.isOpened():
            return video
    raise DataError("this OpenCV cannot write MP4; give --out a name that ends in .gif")


class _Counted:
    """Counts what is taken from it."""

    def __init__(self, pictures: Iterable[Image.Image]) -> None:
        self._pictures = pictures
        self.n = 0

    def __iter__(self) -> Iterator[Image.Image]:
        for picture in self._pictures:
            self.n += 1
            yield picture
