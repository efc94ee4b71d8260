"""Writing pictures as an MP4 or GIF file; the same pictures give the same bytes."""

import tempfile
from collections.abc import Iterable
from itertools import chain, count
from pathlib import Path

import numpy as np
from PIL import Image

from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.formats.files import write_atomically

__all__ = ["ANIMATION_FORMATS", "require_animation_name", "write_animation"]

ANIMATION_FORMATS = (".mp4", ".gif")
# VP9, which browsers play, or MPEG-4 where an OpenCV lacks VP9. No OpenCV wheel encodes H.264.
_CODECS = ("vp09", "mp4v")
_COLOURS = 128  # colours of a picture in a GIF
_HINT = "make room, or give another place with --out"


def require_animation_name(path: Path) -> None:
    """Check that a file name has the suffix of a known format.

    Raises:
        UsageError: it has another suffix.
    """
    if path.suffix.lower() not in ANIMATION_FORMATS:
        raise UsageError(
            f"--out {path}: unknown format; give a file name that ends in {' or '.join(ANIMATION_FORMATS)}"
        )


def write_animation(path: Path, pictures: Iterable[Image.Image], per_second: float) -> int:
    """Write pictures as an animation, atomically, and return their number; only one at a time is in memory.

    Args:
        path: the file; its suffix is one of `ANIMATION_FORMATS`.
        pictures: one or more RGB pictures, all of one size with even sides.
        per_second: frame rate, pictures per second.

    Raises:
        UsageError: the file name has another suffix.
        DataError: the file cannot be written.
    """
    require_animation_name(path)
    write = _write_gif if path.suffix.lower() == ".gif" else _write_mp4
    with (
        wrap_errors(f"{path}: cannot be written", _HINT),
        write_atomically(path) as partial,
        tempfile.TemporaryDirectory(dir=path.parent, prefix=".recording-") as folder,
    ):
        file = Path(folder) / f"animation{path.suffix.lower()}"  # OpenCV chooses by the suffix, which `partial` lacks
        n_pictures = write(file, pictures, per_second)
        file.replace(partial)
    return n_pictures


def _write_gif(path: Path, pictures: Iterable[Image.Image], per_second: float) -> int:
    taken = count()  # advances with each picture
    # No dithering: its noise would make the file larger.
    quantized = (
        picture.quantize(_COLOURS, dither=Image.Dither.NONE) for picture, _ in zip(pictures, taken, strict=False)
    )
    first = next(quantized)
    duration = max(20, round(100 / per_second) * 10)  # GIF has hundredths of a second; viewers take 10 ms for 100 ms
    first.save(path, save_all=True, append_images=quantized, duration=duration, loop=0, optimize=False)
    return next(taken)


def _write_mp4(path: Path, pictures: Iterable[Image.Image], per_second: float) -> int:
    import cv2

    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(0)  # it would print a warning for each missing codec
    rest = iter(pictures)
    first = next(rest)
    n_pictures = 0
    try:
        video = _open_writer(path, first.size, per_second)
        for picture in chain([first], rest):
            n_pictures += 1
            video.write(np.asarray(picture)[:, :, ::-1])  # OpenCV takes BGR
        video.release()
        n_written = int(cv2.VideoCapture(str(path)).get(cv2.CAP_PROP_FRAME_COUNT))
    finally:
        cv2.utils.logging.setLogLevel(level)
    if n_written != n_pictures:  # OpenCV does not report a full disk
        raise DataError(f"{path.parent}: only {n_written} of {n_pictures} pictures could be written; {_HINT}")
    return n_pictures


def _open_writer(path: Path, size: tuple[int, int], per_second: float):  # type: ignore[no-untyped-def]  # cv2 untyped
    import cv2

    for codec in _CODECS:
        video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), per_second, size)
        if video.isOpened():
            return video
    raise DataError("this OpenCV cannot write MP4; give --out a name that ends in .gif")
