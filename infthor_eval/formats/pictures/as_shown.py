"""Pictures as a browser shows them on white: what lies under transparency is hidden, 16 bits of
grey are read as 8, and the picture is turned as its EXIF data say."""

import struct

import numpy as np
from PIL import ExifTags, Image

__all__ = ["as_shown", "conversions", "shown_size"]

_TURNS = {
    2: Image.Transpose.FLIP_LEFT_RIGHT,
    3: Image.Transpose.ROTATE_180,
    4: Image.Transpose.FLIP_TOP_BOTTOM,
    5: Image.Transpose.TRANSPOSE,
    6: Image.Transpose.ROTATE_270,
    7: Image.Transpose.TRANSVERSE,
    8: Image.Transpose.ROTATE_90,
}
_FIRST_ON_ITS_SIDE = 5
_WHITE = (255, 255, 255, 255)


def as_shown(image: Image.Image) -> Image.Image:
    """Return an opened picture in RGB, as it is shown; one that needs nothing as Pillow reads it.

    Raises:
        OSError: the file is damaged; Pillow raises errors of other types, too.
    """
    orientation = _orientation(image)  # before the pixels: browsers ignore EXIF data behind them
    layer = _in_8_bits(image) if _has_16_bits(image) else image
    if layer.has_transparency_data:
        white = Image.new("RGBA", image.size, _WHITE)
        layer = Image.alpha_composite(white, layer.convert("RGBA"))
    shown = layer.convert("RGB")
    return shown.transpose(_TURNS[orientation]) if orientation in _TURNS else shown


def shown_size(image: Image.Image) -> tuple[int, int]:
    """Return width and height of an opened picture as it is shown; no pixel is decoded."""
    width, height = image.size
    return (height, width) if _orientation(image) >= _FIRST_ON_ITS_SIDE else (width, height)


def conversions(image: Image.Image) -> str:
    """Return what `as_shown` does to an opened picture, in words; empty if it needs nothing."""
    orientation = _orientation(image)
    done = {
        "16-bit grey": _has_16_bits(image),
        "CMYK": image.mode == "CMYK",
        "transparency on white": image.has_transparency_data,
        f"EXIF orientation {orientation}": orientation in _TURNS,
    }
    return ", ".join(name for name, is_done in done.items() if is_done)


def _has_16_bits(image: Image.Image) -> bool:
    return image.mode.startswith("I")


def _in_8_bits(image: Image.Image) -> Image.Image:
    """Return 16-bit grey in 8 bits; Pillow would cut values above 255."""
    values = np.asarray(image)
    grey = Image.fromarray((values >> 8).astype(np.uint8))
    clear = image.info.get("transparency")
    if clear is not None:
        grey.putalpha(Image.fromarray(np.where(values == clear, 0, 255).astype(np.uint8)))
    return grey


def _orientation(image: Image.Image) -> int:
    """Return the EXIF orientation, 1 to 8; 1 if there is none, as browsers take damaged data."""
    if "exif" not in image.info:
        return 1
    exif = Image.Exif()
    try:
        exif.load(image.info["exif"])
        orientation = exif.get(ExifTags.Base.Orientation)
    except (SyntaxError, ValueError, LookupError, TypeError, struct.error):
        return 1
    return orientation if orientation in _TURNS else 1
