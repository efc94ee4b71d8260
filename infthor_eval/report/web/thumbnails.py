"""Pictures for a page: thumbnails, each once, and the same ones enlarged, up to a total size."""

import base64
import io
import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from itertools import islice
from typing import NamedTuple, TypeVar

from PIL import Image

from infthor_eval.errors import DataError
from infthor_eval.report.web.progress import PageProgress

_QUALITY = 55  # of WebP: 1 to 3 kB for a frame of 132 pixels, so that thousands fit into a page
_EFFORT = 2  # of WebP: twice as fast as 4, pictures are 5 % larger
_LARGE_SIDE = 480  # the published frames, of 300 pixels, keep their size
_WORK = "frames read"
_LARGE_QUALITY = 70  # about 5 kB for a frame of the embedded simulator
_MOST_THREADS = 4  # more of them wait for Python's lock
_N_AHEAD = 4  # pictures of each thread that wait for their number

T = TypeVar("T")
R = TypeVar("R")
Load = Callable[[], Image.Image]


class _Encoded(NamedTuple):
    """A picture as WebP in base64."""

    thumbnail: str
    enlarged: str | None  # None where that would be no larger


class ThumbnailStore:
    """Thumbnails by number; the first get the room, and all before any enlarged picture."""

    def __init__(self, budget: int, side: int = 132, progress: PageProgress | None = None) -> None:
        """Start without pictures.

        Args:
            budget: maximum size of all pictures together, in bytes of base64.
            side: length of a thumbnail's longer side in pixels.
            progress: observes the pictures that are expected.
        """
        self._progress = progress or PageProgress()
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

    def add(self, key: str, load: Load, side: int | None = None) -> int | None:
        """Add a picture, unless it is there; return its number, or None if there is no room.

        Args:
            key: name of the picture; the same name is the same picture.
            load: loads the picture.
            side: length of its longer side, if it differs from that of the others.
        """
        if key not in self._numbers:
            self._numbers[key] = (
                None if self._is_full else self._place(_encode_both(load, side or self._side))
            )
        return self._numbers[key]

    def add_all(self, loads: Mapping[str, Load]) -> None:
        """Add pictures by key, in their order; one that cannot be read (DataError) has no number.

        They are encoded in threads: Pillow lets others run meanwhile, and a page spends most of its
        time there.
        """
        new = {key: load for key, load in loads.items() if key not in self._numbers}
        if not new:
            return
        self._progress.begin(_WORK, len(new))
        n_threads = min(n_processors(), _MOST_THREADS)
        with ThreadPoolExecutor(n_threads, "thumbnails") as threads:
            begin = partial(self._begin, threads)
            n_ahead = n_threads * _N_AHEAD
            for key, begun in zip(new, _ahead(new.values(), begin, n_ahead), strict=True):
                self._progress.advance(_WORK)
                try:
                    encoded = None if begun is None or self._is_full else begun.result()
                except DataError:
                    continue
                self._numbers[key] = None if encoded is None else self._place(encoded)

    def number(self, key: str) -> int | None:
        """Return the number of a picture, or None if it could not be read or has no room."""
        return self._numbers.get(key)

    @property
    def _is_full(self) -> bool:
        return self._left <= 0 and not self._enlarged

    def _begin(self, threads: ThreadPoolExecutor, load: Load) -> "Future[_Encoded] | None":
        return None if self._is_full else threads.submit(_encode_both, load, self._side)

    def _place(self, encoded: _Encoded) -> int | None:
        self._make_room(len(encoded.thumbnail))
        self._left -= len(encoded.thumbnail)
        if self._left < 0:
            return None
        self._encoded.append(encoded.thumbnail)
        number = len(self._encoded) - 1
        if encoded.enlarged is not None and len(encoded.enlarged) <= self._left:
            self._left -= len(encoded.enlarged)
            self._enlarged.append((number, encoded.enlarged))
        return number

    def _make_room(self, size: int) -> None:
        """Drop the last enlarged pictures until a thumbnail of that size fits, or none is left."""
        while self._enlarged and self._left < size:
            _, dropped = self._enlarged.pop()
            self._left += len(dropped)


def _ahead(items: Iterable[T], begin: Callable[[T], R], n_ahead: int) -> Iterator[R]:
    """Yield what `begin` returns for each item, called for up to `n_ahead` items before."""
    waiting = iter(items)
    begun = deque(map(begin, islice(waiting, n_ahead)))
    while begun:
        yield begun.popleft()
        begun.extend(map(begin, islice(waiting, 1)))


def _encode_both(load: Load, side: int) -> _Encoded:
    picture = load().convert("RGB")
    is_small = max(picture.size) <= side
    return _Encoded(
        _encode(picture, side, _QUALITY),
        None if is_small else _encode(picture, _LARGE_SIDE, _LARGE_QUALITY),
    )


def _encode(picture: Image.Image, side: int, quality: int) -> str:
    small = picture.copy()
    small.thumbnail((side, side), Image.Resampling.LANCZOS)
    encoded = io.BytesIO()
    small.save(encoded, format="webp", quality=quality, method=_EFFORT)
    return base64.b64encode(encoded.getvalue()).decode("ascii")


def n_processors() -> int:
    """Return the processors that this process may use, which may be fewer than there are."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
