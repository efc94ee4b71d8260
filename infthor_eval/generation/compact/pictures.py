"""Pictures of few colours, for sets that come with the package.

They are not compressed one by one: a packed set compresses them together, and the next picture, or
another world's, differs little.
"""

from collections.abc import Iterable
from io import BytesIO

import numpy as np
from PIL import Image

from infthor_eval.formats.frames import FrameRef

# A palette by the number of pixels has none of a small object's colours: a room is walls and floor.
_WEIGHT = 0.6  # a colour counts as the number of its pixels to this power
_FEWEST = 16  # pixels of a colour that counts


def encode_alike(frames: Iterable[FrameRef], colors: int) -> dict[FrameRef, bytes]:
    """Return pictures as PNG files of one palette, so that pixels that were equal stay equal."""
    pictures = {frame: frame.load() for frame in dict.fromkeys(frames)}
    palette = palette_of(pictures.values(), colors)
    return {
        frame: encode(picture.quantize(palette=palette, dither=Image.Dither.NONE))
        for frame, picture in pictures.items()
    }


def encode(picture: Image.Image) -> bytes:
    """Return a picture as a PNG file that is not compressed."""
    content = BytesIO()
    picture.save(content, "PNG", compress_level=0)
    return content.getvalue()


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
