"""References to frames, decoded only where pixels are needed.

A trajectory has thousands of frames and a question refers to many of them, so requests carry references and the
model's adapter decodes. A reference knows the digest of its file's content, by which caches recognise a frame.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from PIL import Image, UnidentifiedImageError

from infthor_eval.errors import DataError
from infthor_eval.formats.digests import digest_of_file

__all__ = ["FrameRef"]

_SIGNATURES = (b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff")  # PNG, JPEG


@dataclass(frozen=True)
class FrameRef:
    """One frame of a trajectory, by the path of its image file (PNG or JPEG, 300x300 in the published data)."""

    path: Path

    @cached_property
    def digest(self) -> str:
        """Hash of the file's content (hex, 32 characters).

        Raises:
            DataError: the file cannot be read.
        """
        try:
            return digest_of_file(self.path)
        except OSError as error:
            raise DataError(f"{self.path}: cannot be read ({error.strerror}); restore the frame") from error

    def problem(self) -> str | None:
        """Why this cannot be a frame, judged by the first bytes alone; None where nothing speaks against it."""
        try:
            with self.path.open("rb") as file:
                head = file.read(8)
        except OSError as error:
            return f"{self.path}: cannot be read ({error.strerror})"
        return None if head.startswith(_SIGNATURES) else f"{self.path}: not a PNG or JPEG image"

    def load(self) -> Image.Image:
        """The frame as an RGB image.

        Raises:
            DataError: the file is missing, not an image, or cut off.
        """
        try:
            with Image.open(self.path) as image:
                return image.convert("RGB")
        except (UnidentifiedImageError, OSError, SyntaxError) as error:
            raise DataError(f"{self.path}: not a readable image ({error}); restore the frame") from error
