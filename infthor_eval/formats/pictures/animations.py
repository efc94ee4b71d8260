"""Writing pictures as an MP4 or GIF file; the same pictures give the same bytes."""

from collections.abc import Iterable
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.storage.files import write_atomically, writing_hint
from infthor_eval.storage.scratch import ScratchFolder

if TYPE_CHECKING:
    import cv2

ANIMATION_FORMATS = (".mp4", ".gif")
# VP9, which browsers play, or MPEG-4 where an OpenCV lacks VP9. No OpenCV wheel encodes H.264.
_CODECS = ("vp09", "mp4v")
_COLOURS = 255  # colours of a GIF; one more is for what stays as it was
_SHADES = 32  # of red, green and blue: pixels are counted in cubes of colours, by their mean
_COUNTED = 1 << 18  # votes of all pixels on the palette
_HINT = writing_hint(", or give another place with --out")


def require_animation_name(path: Path) -> None:
    """Check that a file name has the suffix of a known format."""
    if path.suffix.lower() not in ANIMATION_FORMATS:
        raise UsageError(
            f"--out {path}: unknown format; give a file name that ends in "
            f"{' or '.join(ANIMATION_FORMATS)}"
        )


def write_animation(path: Path, pictures: Iterable[Image.Image], per_second: float) -> int:
    """Write pictures as an animation, atomically; return their number. One at a time is in memory.

    Args:
        path: the file; its suffix is one of `ANIMATION_FORMATS`.
        pictures: one or more RGB pictures, all of one size with even sides.
        per_second: frame rate, pictures per second.
    """
    require_animation_name(path)
    write = _write_gif if path.suffix.lower() == ".gif" else _write_mp4
    with (
        wrap_errors(f"{path}: cannot be written", _HINT),
        write_atomically(path) as partial,
        ScratchFolder(path.parent) as folder,
    ):
        # OpenCV chooses by the suffix, which `partial` lacks.
        file = folder / f"animation{path.suffix.lower()}"
        n_pictures = write(file, pictures, per_second)
        file.replace(partial)
    return n_pictures


def _write_gif(path: Path, pictures: Iterable[Image.Image], per_second: float) -> int:
    """Write a GIF with one palette: a palette each would change colours of what does not move."""
    counts = np.zeros((4, _SHADES**3))
    kept = []
    # All of them are needed before the first is written.
    for number, picture in enumerate(pictures):
        counts += _count_colours(picture)
        kept.append(path.with_name(f"{number}.png"))
        picture.save(kept[-1], compress_level=1)
    palette = _choose_palette(counts)
    quantized = (_in_palette(file, palette) for file in kept)
    # GIF has hundredths of a second; viewers take 10 ms for 100 ms.
    duration = max(20, round(100 / per_second) * 10)
    next(quantized).save(
        path, save_all=True, append_images=quantized, duration=duration, loop=0, optimize=False
    )
    return len(kept)


def _count_colours(picture: Image.Image) -> NDArray[np.float64]:
    """Return number and sums of red, green and blue of the pixels in `_SHADES`³ cubes: [4, n]."""
    pixels = np.asarray(picture.convert("RGB")).reshape(-1, 3).astype(np.int64)
    cubes = pixels * _SHADES // 256 @ (_SHADES**2, _SHADES, 1)
    weights = (None, *pixels.T)
    return np.stack(
        [np.bincount(cubes, weight, _SHADES**3).astype(np.float64) for weight in weights]
    )


def _choose_palette(counts: NDArray[np.float64]) -> Image.Image:
    """Return an image whose palette suits all counted pixels; a rare colour has a vote, too."""
    number, *sums = counts[:, counts[0] > 0]
    colours = np.round(np.stack(sums, axis=-1) / number[:, None]).astype(np.uint8)
    votes = np.ceil(number * (_COUNTED / number.sum())).astype(np.int64)
    source = Image.fromarray(np.repeat(colours, votes, axis=0)[None])
    return source.quantize(_COLOURS, method=Image.Quantize.MEDIANCUT)


def _in_palette(file: Path, palette: Image.Image) -> Image.Image:
    with Image.open(file) as picture:
        # Noise makes files larger.
        return picture.convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE)


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
        raise DataError(
            f"{path.parent}: only {n_written} of {n_pictures} pictures could be written; {_HINT}"
        )
    return n_pictures


def _open_writer(path: Path, size: tuple[int, int], per_second: float) -> "cv2.VideoWriter":
    import cv2

    for codec in _CODECS:
        video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), per_second, size)
        if video.isOpened():
            return video
    raise DataError("this OpenCV cannot write MP4; give --out a name that ends in .gif")
