"""Pictures as a browser shows them on white: nothing shows of colours under transparency, 16 bits
of grey are read as 8, and EXIF data turn the picture."""

import struct
from contextlib import suppress

from PIL import ExifTags, Image
from PIL.Image import Transpose

# By EXIF orientation, from 2; from 5 on width and height change places.
_TURNS = {2: Transpose.FLIP_LEFT_RIGHT, 3: Transpose.ROTATE_180, 4: Transpose.FLIP_TOP_BOTTOM}
_TURNS |= {5: Transpose.TRANSPOSE, 6: Transpose.ROTATE_270, 7: Transpose.TRANSVERSE}
_TURNS |= {8: Transpose.ROTATE_90}


def as_shown(image: Image.Image) -> Image.Image:
    """Return an opened picture in RGB, as it is shown."""
    turn = _TURNS.get(orientation(image))  # before decoding: browsers ignore EXIF data behind it
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


def conversions(image: Image.Image) -> str:
    """Return what `as_shown` does to an opened picture, in words; empty if it needs nothing."""
    done = {
        "16-bit grey": image.mode.startswith("I"),
        "CMYK": image.mode == "CMYK",
        "transparency on white": image.has_transparency_data,
        f"EXIF orientation {orientation(image)}": orientation(image) > 1,
    }
    return ", ".join(name for name, is_done in done.items() if is_done)


def orientation(image: Image.Image) -> int:
    """Return the EXIF orientation of an opened picture, 1 to 8; 1 where none is."""
    exif = Image.Exif()
    if "exif" in image.info:
        with suppress(SyntaxError, ValueError, LookupError, TypeError, struct.error):
            exif.load(image.info["exif"])
    stored = exif.get(ExifTags.Base.Orientation)
    return stored if stored in _TURNS else 1
