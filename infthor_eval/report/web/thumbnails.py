"""Small pictures for a page, each once, within a budget of bytes."""

import base64
import io
from collections.abc import Callable

from PIL import Image

__all__ = ["Thumbnails"]

_QUALITY = 55  # of WebP; at 132 pixels a frame takes some three kilobytes


class Thumbnails:
    """Pictures by number; whoever comes first gets the room."""

    def __init__(self, budget: int, side: int = 132) -> None:
        """Begin with none.

        Args:
            budget: bytes of all pictures together, as they stand in the page.
            side: pixels of the longer side of a picture.
        """
        self._left = budget
        self._side = side
        self._made: list[str] = []
        self._numbers: dict[str, int | None] = {}

    @property
    def encoded(self) -> list[str]:
        """All pictures, by their numbers, as WebP in base64."""
        return self._made

    @property
    def n_left_out(self) -> int:
        """Pictures that there was no room for."""
        return sum(number is None for number in self._numbers.values())

    def add(self, key: str, load: Callable[[], Image.Image], side: int | None = None) -> int | None:
        """The number of a picture.

        Args:
            key: what it is known by; the same key is the same picture.
            load: gives it.
            side: pixels of its longer side, if it is not like the others.

        Returns:
            None where there is no room for it.
        """
        if key not in self._numbers:
            self._numbers[key] = self._add(load, side or self._side) if self._left > 0 else None
        return self._numbers[key]

    def _add(self, load: Callable[[], Image.Image], side: int) -> int | None:
        encoded = _encoded(load(), side)
        self._left -= len(encoded)
        if self._left < 0:
            return None
        self._made.append(encoded)
        return len(self._made) - 1


def _encoded(picture: Image.Image, side: int) -> str:
    small = picture.convert("RGB")
    small.thumbnail((side, side), Image.Resampling.LANCZOS)
    written = io.BytesIO()
    small.save(written, format="webp", quality=_QUALITY, method=4)
    return base64.b64encode(written.getvalue()).decode("ascii")
