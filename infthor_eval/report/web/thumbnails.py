"""Thumbnails for a page, each once, up to a total size."""

import base64
import io
from collections.abc import Callable

from PIL import Image

__all__ = ["ThumbnailStore"]

_QUALITY = 55  # of WebP: about 3 kB for a frame of 132 pixels, so that thousands fit into a page


class ThumbnailStore:
    """Thumbnails by number; pictures that come first get the room.

    Attributes:
        encoded: all pictures as WebP in base64, in the order of their numbers.
    """

    def __init__(self, budget: int, side: int = 132) -> None:
        """Start without pictures.

        Args:
            budget: maximum size of all pictures together, in bytes of base64.
            side: length of a picture's longer side in pixels.
        """
        self._left = budget
        self._side = side
        self.encoded: list[str] = []
        self._numbers: dict[str, int | None] = {}

    @property
    def n_left_out(self) -> int:
        """Number of pictures that there was no room for."""
        return sum(number is None for number in self._numbers.values())

    def add(self, key: str, load: Callable[[], Image.Image], side: int | None = None) -> int | None:
        """Add a picture, unless it was added before, and return its number; None if there is no room for it.

        Args:
            key: name of the picture; the same name is the same picture.
            load: loads the picture.
            side: length of its longer side, if it differs from that of the others.
        """
        if key not in self._numbers:
            self._numbers[key] = self._add(load, side or self._side) if self._left > 0 else None
        return self._numbers[key]

    def _add(self, load: Callable[[], Image.Image], side: int) -> int | None:
        encoded = _encode(load(), side)
        self._left -= len(encoded)
        if self._left < 0:
            return None
        self.encoded.append(encoded)
        return len(self.encoded) - 1


def _encode(picture: Image.Image, side: int) -> str:
    small = picture.convert("RGB")
    small.thumbnail((side, side), Image.Resampling.LANCZOS)
    encoded = io.BytesIO()
    small.save(encoded, format="webp", quality=_QUALITY, method=4)
    return base64.b64encode(encoded.getvalue()).decode("ascii")
