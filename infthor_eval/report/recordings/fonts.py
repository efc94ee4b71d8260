"""Text on pictures: a font that is the same everywhere, and texts that fit into their place."""

from functools import cache
from pathlib import Path

import matplotlib
from PIL import ImageFont

from infthor_eval.terminal import printable

__all__ = ["Font", "fitted", "font", "lines_of", "one_line"]

Font = ImageFont.FreeTypeFont
_MORE = "…"
_LONGEST = 400  # letters of which anybody may want to see the width


@cache
def font(size: int, style: str = "") -> Font:
    """DejaVu Sans as it comes with matplotlib, not as a machine may have it: "", "-Bold", or "Mono"."""
    file = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / f"DejaVuSans{style}.ttf"
    return ImageFont.truetype(file, size, layout_engine=ImageFont.Layout.BASIC)


def one_line(text: str) -> str:
    """A text of data or of a model as one line without control characters."""
    return printable(" ".join(text[:_LONGEST].split()))


def fitted(text: str, face: Font, width: float) -> str:
    """A line, cut where it is longer than so many pixels."""
    return text if face.getlength(text) <= width else _begun(text, face, width) + _MORE


def lines_of(text: str, face: Font, width: float, most: int) -> list[str]:
    """A text in lines of so many pixels, broken between words; the last one is cut where it needs more than `most`."""
    lines: list[str] = []
    words = text.split()
    while words and len(lines) < most - 1:
        taken = 1
        while taken < len(words) and face.getlength(" ".join(words[: taken + 1])) <= width:
            taken += 1
        lines.append(fitted(" ".join(words[:taken]), face, width))
        words = words[taken:]
    return [*lines, fitted(" ".join(words), face, width)] if words else lines


def _begun(text: str, face: Font, width: float) -> str:
    """The longest beginning that leaves room for the dots."""
    low, high = 0, len(text)
    while low < high:
        middle = (low + high + 1) // 2
        if face.getlength(text[:middle].rstrip() + _MORE) <= width:
            low = middle
        else:
            high = middle - 1
    return text[:low].rstrip()
