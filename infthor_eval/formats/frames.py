"""References to frames, which are decoded only where pixels are needed.

A trajectory has thousands of frames and a question refers to many of them, so requests carry
references and the model's adapter decodes. Caches recognise a frame by the digest of its content.

Pictures look as a browser shows them on white: nothing shows of colours under transparency, 16 bits
of grey are read as 8, and EXIF data turn the picture.
"""

import re
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path

from PIL import ExifTags, Image, UnidentifiedImageError
from PIL.Image import Transpose

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.packed.paths import PackedPath, SetPath
from infthor_eval.formats.reading import file_problem, read_bytes, require_file
from infthor_eval.storage.digests import digest
from infthor_eval.storage.limits import IMAGE_ASPECT, IMAGE_MEGAPIXELS

Image.MAX_IMAGE_PIXELS = None  # `_wrong_size` has the limit, which users can raise

_PNG = b"\x89PNG\r\n\x1a\n"
_SIGNATURE = re.compile(rb"\x89PNG\r\n\x1a\n|\xff\xd8\xff|RIFF.{4}WEBP", re.DOTALL)
_HEAD = 24  # bytes of a PNG up to the end of its width and height
_HINT = "restore the frame"
_NO_IMAGE = "not a PNG, JPEG or WebP image"
_SUFFIXES = {".png", ".jpg", ".jpeg", ".webp"}
_NUMBER = re.compile(r"([0-9]+)")
# All that Pillow's decoders have raised on damaged or forged images.
_DAMAGED = (
    OSError,
    SyntaxError,
    ValueError,
    ArithmeticError,
    LookupError,
    TypeError,
    AttributeError,
    EOFError,
    MemoryError,
    struct.error,
    zlib.error,
    Image.DecompressionBombError,
)
# By EXIF orientation, from 2; from 5 on width and height change places.
_TURNS = {2: Transpose.FLIP_LEFT_RIGHT, 3: Transpose.ROTATE_180, 4: Transpose.FLIP_TOP_BOTTOM}
_TURNS |= {5: Transpose.TRANSPOSE, 6: Transpose.ROTATE_270, 7: Transpose.TRANSVERSE}
_TURNS |= {8: Transpose.ROTATE_90}


@dataclass(frozen=True)
class FrameRef:
    """One frame of a trajectory.

    Attributes:
        path: its image (PNG, JPEG or WebP; 300x300 in the published data).
    """

    path: SetPath

    @property
    def name(self) -> str:
        """Name of its file."""
        return self.path.name

    @cached_property
    def n_bytes(self) -> int | None:
        """Size of its file, or None if it is missing."""
        try:
            return self.path.stat().st_size
        except OSError:
            return None

    @cached_property
    def digest(self) -> str:
        """Hash of its file's content (hex, 32 characters).

        Raises:
            DataError: the file cannot be read.
        """
        return digest(read_bytes(self.path, _HINT))

    @cached_property
    def size(self) -> tuple[int, int]:
        """Width and height from the file's header; no pixel is decoded.

        Raises:
            DataError: as `load`, for errors that show in the header.
        """
        with _open(self.path) as image:
            return image.size[::-1] if _orientation(image) > 4 else image.size

    @cached_property
    def conversions(self) -> str:
        """What `load` does to the picture, in words; raises as `size`."""
        with _open(self.path) as image:
            return _conversions(image)

    @cached_property
    def problem(self) -> str | None:
        """Why this cannot be a frame, by the first bytes of its file, or None."""
        return _problem_of(self.path)

    def load(self) -> Image.Image:
        """Return the frame as an RGB image, as a browser shows it on white.

        Raises:
            DataError: the file is missing, truncated, or no image of a valid size.
        """
        with _open(self.path) as image:
            return as_shown(image)

    def png(self) -> bytes:
        """Return the frame as the content of a PNG file.

        Raises:
            DataError: as `load`.
        """
        content = BytesIO()
        self.load().save(content, "PNG")
        return content.getvalue()

    def encoded(self) -> tuple[bytes, str]:
        """Return content and media type of its file, or of a PNG if it is not shown as its file
        is; raises as `load`."""
        if self.conversions:
            return self.png(), "image/png"
        with _open(self.path) as image:
            return read_bytes(self.path, _HINT), Image.MIME[str(image.format)]


def find_images(folder: SetPath) -> dict[str, SetPath]:
    """Return the PNG, JPEG and WebP files of a folder by stem, in the order of their names.

    Numbers in names count as numbers: `2.png` comes before `10.png`.

    Raises:
        DataError: two of them have one stem.
    """
    images: dict[str, SetPath] = {}
    paths = [path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES]
    for path in sorted(paths, key=_by_numbers):
        if path.stem in images:
            raise DataError(f"{folder}: two frames have the name {path.stem}; remove one of them")
        images[path.stem] = path
    return images


def _by_numbers(path: SetPath) -> tuple[list[tuple[int, str]], str]:
    parts = _NUMBER.split(path.stem)  # every second one is a number
    return [(int(part), "") if at % 2 else (0, part) for at, part in enumerate(parts)], path.name


def _problem_of(path: SetPath) -> str | None:
    reason = file_problem(path)
    if reason is not None:
        return f"{path}: {reason}"
    if isinstance(path, PackedPath):  # whose frames may be on a server
        size = path.image_size
        return _wrong_size(path, *size) if size else f"{path}: {_NO_IMAGE}"
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as error:
        return f"{path}: cannot be read ({error.strerror})"
    if _SIGNATURE.match(head) is None:
        return f"{path}: {_NO_IMAGE}"
    is_whole_png_head = head.startswith(_PNG) and len(head) == _HEAD and head[12:16] == b"IHDR"
    return _wrong_size(path, *struct.unpack(">II", head[16:])) if is_whole_png_head else None


@contextmanager
def _open(path: SetPath) -> Iterator[Image.Image]:
    require_file(path, _HINT)
    with (
        wrap_errors(f"{path}: not a readable image", _HINT, catch=_DAMAGED),
        _opened(path) as image,
    ):
        problem = _wrong_size(path, *image.size)
        if problem is not None:
            raise DataError(f"{problem}; {_HINT}")
        yield image


def _opened(path: SetPath) -> Image.Image:
    try:
        file = path if isinstance(path, Path) else path.open()
        return Image.open(file, formats=("PNG", "JPEG", "WEBP"))
    except UnidentifiedImageError as error:  # its message is the path
        raise DataError(f"{path}: not a readable image (not PNG, JPEG or WebP); {_HINT}") from error


def _wrong_size(path: SetPath, width: int, height: int) -> str | None:
    """Return why an image of this size is refused: for its memory, or by image processors."""
    if min(width, height) < 1:
        return f"{path}: an image of {width}x{height} pixels"
    if width * height > IMAGE_MEGAPIXELS.value * 1_000_000:
        return f"{path}: an image of {width}x{height} pixels is too large; {IMAGE_MEGAPIXELS.hint}"
    if max(width, height) > IMAGE_ASPECT.value * min(width, height):
        return f"{path}: an image of {width}x{height} pixels is too narrow; {IMAGE_ASPECT.hint}"
    return None


def as_shown(image: Image.Image) -> Image.Image:
    """Return an opened picture in RGB, as it is shown."""
    turn = _TURNS.get(_orientation(image))  # before decoding: browsers ignore EXIF data behind it
    if image.mode.startswith("I"):
        import numpy as np  # which commands without frames need not load

        values, key = np.asarray(image), image.info.get("transparency")
        image = Image.fromarray((values >> 8).astype(np.uint8))  # Pillow cuts what is above 255
        if key is not None:
            image.putalpha(Image.fromarray(np.where(values == key, 0, 255).astype(np.uint8)))
    if image.has_transparency_data:
        white = Image.new("RGBA", image.size, "white")
        image = Image.alpha_composite(white, image.convert("RGBA"))
    shown = image.convert("RGB")
    return shown if turn is None else shown.transpose(turn)


def _conversions(image: Image.Image) -> str:
    """Return what `as_shown` does to an opened picture, in words; empty if it needs nothing."""
    done = {
        "16-bit grey": image.mode.startswith("I"),
        "CMYK": image.mode == "CMYK",
        "transparency on white": image.has_transparency_data,
        f"EXIF orientation {_orientation(image)}": _orientation(image) > 1,
    }
    return ", ".join(name for name, is_done in done.items() if is_done)


def _orientation(image: Image.Image) -> int:
    """Return the EXIF orientation of an opened picture, 1 to 8; 1 where none is."""
    exif = Image.Exif()
    if "exif" in image.info:
        with suppress(SyntaxError, ValueError, LookupError, TypeError, struct.error):
            exif.load(image.info["exif"])
    stored = exif.get(ExifTags.Base.Orientation)
    return stored if stored in _TURNS else 1
