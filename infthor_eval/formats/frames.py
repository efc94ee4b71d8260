"""References to frames, which are decoded only where pixels are needed.

A trajectory has thousands of frames and a question refers to many of them, so requests carry
references and the model's adapter decodes. Caches recognise a frame by the digest of its file's
content.
"""

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from PIL import Image, UnidentifiedImageError

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.reading import file_problem, require_file
from infthor_eval.storage.digests import digest_of_file
from infthor_eval.storage.limits import IMAGE_ASPECT, IMAGE_MEGAPIXELS

__all__ = ["FrameRef"]

Image.MAX_IMAGE_PIXELS = None  # `_wrong_size` has the limit, which users can raise

_PNG = b"\x89PNG\r\n\x1a\n"
_SIGNATURES = (_PNG, b"\xff\xd8\xff")  # PNG, JPEG
_HEAD = 24  # bytes of a PNG up to the end of its width and height
_HINT = "restore the frame"
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


@dataclass(frozen=True)
class FrameRef:
    """One frame of a trajectory: path of its image (PNG or JPEG, 300x300 in the published data)."""

    path: Path

    @cached_property
    def digest(self) -> str:
        """Hash of the file's content (hex, 32 characters).

        Raises:
            DataError: the file cannot be read.
        """
        require_file(self.path, _HINT)
        with wrap_errors(f"{self.path}: cannot be read", _HINT):
            return digest_of_file(self.path)

    @cached_property
    def size(self) -> tuple[int, int]:
        """Width and height from the file's header; no pixel is decoded.

        Raises:
            DataError: as `load`, for errors that show in the header.
        """
        with self._open() as image:
            return image.size

    def problem(self) -> str | None:
        """Return why this cannot be a frame, by its first bytes, or None if those are right."""
        reason = file_problem(self.path)
        if reason is not None:
            return f"{self.path}: {reason}"
        try:
            with self.path.open("rb") as file:
                head = file.read(_HEAD)
        except OSError as error:
            return f"{self.path}: cannot be read ({error.strerror})"
        if not head.startswith(_SIGNATURES):
            return f"{self.path}: not a PNG or JPEG image"
        is_whole_png_head = head.startswith(_PNG) and len(head) == _HEAD and head[12:16] == b"IHDR"
        return self._wrong_size(*struct.unpack(">II", head[16:])) if is_whole_png_head else None

    def load(self) -> Image.Image:
        """Return the frame as an RGB image.

        Raises:
            DataError: the file is missing, truncated, or no image of a valid size.
        """
        with self._open() as image:
            return image.convert("RGB")

    @contextmanager
    def _open(self) -> Iterator[Image.Image]:
        require_file(self.path, _HINT)
        with (
            wrap_errors(f"{self.path}: not a readable image", _HINT, catch=_DAMAGED),
            self._opened() as image,
        ):
            problem = self._wrong_size(*image.size)
            if problem is not None:
                raise DataError(f"{problem}; {_HINT}")
            yield image

    def _opened(self) -> Image.Image:
        try:
            return Image.open(self.path, formats=("PNG", "JPEG"))
        except UnidentifiedImageError as error:  # its message is the path
            raise DataError(
                f"{self.path}: not a readable image (neither PNG nor JPEG); {_HINT}"
            ) from error

    def _wrong_size(self, width: int, height: int) -> str | None:
        """Return why an image of this size is refused: for its memory, or by image processors."""
        if min(width, height) < 1:
            return f"{self.path}: an image of {width}x{height} pixels"
        if width * height > IMAGE_MEGAPIXELS.value * 1_000_000:
            return (
                f"{self.path}: an image of {width}x{height} pixels is too large; "
                f"{IMAGE_MEGAPIXELS.hint}"
            )
        if max(width, height) > IMAGE_ASPECT.value * min(width, height):
            return (
                f"{self.path}: an image of {width}x{height} pixels is too narrow; "
                f"{IMAGE_ASPECT.hint}"
            )
        return None
