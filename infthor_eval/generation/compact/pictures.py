"""Storing the pictures of one base trajectory's worlds in few bytes.

All have one palette, so that pixels that were equal stay equal. A picture that differs from an
earlier one in a part is stored as a patch over it: twins differ in an object or two, and an agent
that turns back sees the same again.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.shared_frames import patched_name, store_encoded

_Pixels = NDArray[np.uint8]  # [height, width], indices of colours

# A palette by the number of pixels has none of a small object's colours: a room is walls and floor.
_WEIGHT = 0.6  # a colour counts as the number of its pixels to this power
_FEWEST = 16  # pixels of a colour that counts
_SURELY_SMALLER = 0.1  # share of the pixels up to which a patch is smaller than the picture
_MOST_LAYERS = 3  # of patches; each is decoded when a frame is loaded
_NARROWEST = 8  # pixels of a patch's sides
_LINE = 45  # bytes that a patch takes in the lists of frames


@dataclass(frozen=True)
class _Stored:
    """A picture that is stored."""

    name: str
    pixels: _Pixels
    n_layers: int


class PictureStore:
    """Stores the pictures of one base trajectory in a set.

    Args:
        root: folder of the set.
        frames: the pictures, all of one size.
        colors: number of colours of their palette.
    """

    def __init__(self, root: Path, frames: Iterable[FrameRef], colors: int) -> None:
        self._root = root
        pictures = {frame: frame.load() for frame in dict.fromkeys(frames)}
        palette = palette_of(pictures.values(), colors)
        self._colors = np.array(palette.getpalette(), dtype=np.uint8).reshape(-1, 3)
        self._pixels = {
            frame: np.asarray(picture.quantize(palette=palette, dither=Image.Dither.NONE))
            for frame, picture in pictures.items()
        }
        self._names: dict[bytes, str] = {}
        self._stored: list[_Stored] = []

    def name(self, frame: FrameRef) -> str:
        """Return the name of a picture in the set, and store it if it is not there.

        Pictures that the palette makes equal have one name.
        """
        pixels = self._pixels[frame]
        key = pixels.tobytes()
        if key not in self._names:
            stored = self._store(pixels)
            self._stored.append(stored)
            self._names[key] = stored.name
        return self._names[key]

    def _store(self, pixels: _Pixels) -> _Stored:
        below, share = self._nearest(pixels)
        patch = None if below is None else self._patch(below.pixels, pixels)
        if share > _SURELY_SMALLER:
            whole = self._encode(pixels)
            if patch is None or len(whole) <= len(patch.content) + _LINE:
                return _Stored(store_encoded(self._root, whole), pixels, 0)
        assert below is not None
        assert patch is not None
        name = store_encoded(self._root, patch.content)
        name = patched_name(below.name, name, patch.left, patch.top)
        return _Stored(name, pixels, below.n_layers + 1)

    def _nearest(self, pixels: _Pixels) -> tuple[_Stored | None, float]:
        """Return the stored picture that differs least, and the share of its pixels that differ."""
        usable = [stored for stored in self._stored if stored.n_layers < _MOST_LAYERS]
        counts = [np.count_nonzero(stored.pixels != pixels) for stored in usable]
        if not counts:
            return None, 1
        nearest = int(np.argmin(counts))
        return usable[nearest], counts[nearest] / pixels.size

    def _patch(self, below: _Pixels, pixels: _Pixels) -> "_Patch":
        differs = below != pixels
        rows = _stretch(differs.any(axis=1))
        columns = _stretch(differs.any(axis=0))
        part = pixels[rows, columns].astype(np.int16)
        content = self._encode(np.where(differs[rows, columns], part, -1))
        return _Patch(content, columns.start, rows.start)

    def _encode(self, pixels: NDArray[np.integer]) -> bytes:
        """Return a PNG with the colours that occur; -1 is transparent."""
        used, indices = np.unique(pixels, return_inverse=True)
        image = Image.fromarray(indices.reshape(pixels.shape).astype(np.uint8), mode="P")
        image.putpalette(self._colors[np.maximum(used, 0)].tobytes())
        content = BytesIO()
        options = {"transparency": 0} if used[0] < 0 else {}
        image.save(content, "PNG", optimize=True, **options)
        return content.getvalue()


@dataclass(frozen=True)
class _Patch:
    """Where a picture differs from another one, as a PNG, and its place."""

    content: bytes
    left: int
    top: int


def _stretch(differs: NDArray[np.bool_]) -> slice:
    """Return the rows or columns from the first to the last that differ, and some if these are few.

    Image processors and readers refuse pictures that are narrow.
    """
    (indices,) = np.nonzero(differs)
    start = max(0, min(int(indices[0]), len(differs) - _NARROWEST))
    return slice(start, max(int(indices[-1]) + 1, min(start + _NARROWEST, len(differs))))


def reduce_colors(picture: Image.Image, colors: int) -> Image.Image:
    """Return a picture in so many colours, of which none is far from what it was.

    Cut at the median, colours that are rare are given up for shades of the walls: a green lettuce
    is grey in one frame and green in the next.
    """
    return picture.quantize(colors, Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE)


def palette_of(pictures: Iterable[Image.Image], colors: int) -> Image.Image:
    """Return an image whose palette suits all pictures, also their small parts."""
    counts = np.zeros(2**15, dtype=np.int64)
    sums = np.zeros((2**15, 3))
    for picture in pictures:
        values = np.asarray(picture).reshape(-1, 3)
        red, green, blue = (values >> 3).astype(np.int64).T
        cells = red << 10 | green << 5 | blue
        counts += np.bincount(cells, minlength=len(counts))
        for channel in range(3):
            sums[:, channel] += np.bincount(cells, values[:, channel], len(counts))
    common = counts >= min(_FEWEST, counts.max())
    means = np.round(sums[common] / counts[common, None]).astype(np.uint8)
    repeats = np.round(counts[common] ** _WEIGHT).astype(int)
    weighted = Image.fromarray(np.repeat(means, repeats, axis=0)[None])
    return reduce_colors(weighted, colors)
