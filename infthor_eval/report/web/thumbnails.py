"""Pictures for a page: thumbnails, each once, and the same ones enlarged, up to a total size."""

import base64
import io
from collections.abc import Callable, Mapping, Sequence

from PIL import Image

from infthor_eval.report.web.progress import PageProgress, Silent

__all__ = ["ThumbnailStore"]

_QUALITY = 55  # of WebP: 1 to 3 kB for a frame of 132 pixels, so that thousands fit into a page
_EFFORT = 2  # of WebP: twice as fast as 4, pictures are 5 % larger
_LARGE_SIDE = 480  # the published frames, of 300 pixels, keep their size
_WORK = "frames read"
_LARGE_QUALITY = 70  # about 5 kB for a frame of the embedded simulator


class ThumbnailStore:
    """Thumbnails by number; the first get the room, and all before any enlarged picture."""

    def __init__(self, budget: int, side: int = 132, progress: PageProgress | None = None) -> None:
        """Start without pictures.

        Args:
            budget: maximum size of all pictures together, in bytes of base64.
            side: length of a thumbnail's longer side in pixels.
            progress: observes the pictures that are expected.
        """
        self._progress = progress or Silent()
        self._n_expected = 0
        self._left = budget  # as enlarged pictures leave it
        self._side = side
        self._encoded: list[str] = []
        self._enlarged: list[tuple[int, str]] = []  # with the numbers of their thumbnails
        self._numbers: dict[str, int | None] = {}

    @property
    def encoded(self) -> Sequence[str]:
        """All pictures as WebP in base64 by number: thumbnails, then enlarged ones."""
        return [*self._encoded, *(picture for _, picture in self._enlarged)]

    @property
    def large(self) -> Mapping[int, int]:
        """Number of the enlarged picture by that of its thumbnail, where there was room for it."""
        return {
            thumbnail: number
            for number, (thumbnail, _) in enumerate(self._enlarged, len(self._encoded))
        }

    @property
    def n_left_out(self) -> int:
        """Number of pictures that there was no room for."""
        return sum(number is None for number in self._numbers.values())

    def expect(self, n: int) -> None:
        """Announce the next n pictures, so that whoever waits for them sees how far they are."""
        self._n_expected = n
        if n:
            self._progress.begin(_WORK, n)

    def add(self, key: str, load: Callable[[], Image.Image], side: int | None = None) -> int | None:
        """Add a picture, unless it is there; return its number, or None if there is no room.

        Args:
            key: name of the picture; the same name is the same picture.
            load: loads the picture.
            side: length of its longer side, if it differs from that of the others.
        """
        if key not in self._numbers:
            if self._n_expected:
                self._n_expected -= 1
                self._progress.advance(_WORK)
            self._numbers[key] = (
                self._add(load, side or self._side) if self._left > 0 or self._enlarged else None
            )
        return self._numbers[key]

    def _add(self, load: Callable[[], Image.Image], side: int) -> int | None:
        picture = load().convert("RGB")
        encoded = _encode(picture, side, _QUALITY)
        self._make_room(len(encoded))
        self._left -= len(encoded)
        if self._left < 0:
            return None
        self._encoded.append(encoded)
        number = len(self._encoded) - 1
        if self._left > 0 and max(picture.size) > side:
            self._enlarge(number, picture)
        return number

    def _enlarge(self, number: int, picture: Image.Image) -> None:
        encoded = _encode(picture, _LARGE_SIDE, _LARGE_QUALITY)
        if len(encoded) <= self._left:
            self._left -= len(encoded)
            self._enlarged.append((number, encoded))

    def _make_room(self, size: int) -> None:
        """Drop the last enlarged pictures until a thumbnail of that size fits, or none is left."""
        while self._enlarged and self._left < size:
            _, dropped = self._enlarged.pop()
            self._left += len(dropped)


def _encode(picture: Image.Image, side: int, quality: int) -> str:
    small = picture.copy()
    small.thumbnail((side, side), Image.Resampling.LANCZOS)
    encoded = io.BytesIO()
    small.save(encoded, format="webp", quality=quality, method=_EFFORT)
    return base64.b64encode(encoded.getvalue()).decode("ascii")
