"""Text on pictures: a font that is the same on every machine, and texts that fit into a width."""

from bisect import bisect_right
from functools import cache
from pathlib import Path

import matplotlib
from PIL import ImageFont

from infthor_eval.terminal import printable

Font = ImageFont.FreeTypeFont
_MORE = "…"
_LONGEST = 400  # letters; more are never shown, and measuring them takes time


@cache
def font(size: int, style: str = "") -> Font:
    """Return DejaVu Sans in a size and a style ("", "-Bold" or "Mono").

    It is matplotlib's copy, since a machine may have another version or none.
    """
    file = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / f"DejaVuSans{style}.ttf"
    return ImageFont.truetype(file, size, layout_engine=ImageFont.Layout.BASIC)


def one_line(text: str) -> str:
    """Return a text of data or of a model as one line without control characters."""
    return printable(" ".join(text[:_LONGEST].split()))


def fit_line(text: str, face: Font, width: float) -> str:
    """Return a line, cut if it is longer than `width` pixels."""
    return text if face.getlength(text) <= width else _longest_beginning(text, face, width) + _MORE


def break_lines(text: str, face: Font, width: float, most: int) -> list[str]:
    """Break a text between words into lines of `width` pixels; the last of `most` may be cut."""
    lines: list[str] = []
    words = text.split()
    while words and len(lines) < most - 1:
        taken = 1
        while taken < len(words) and face.getlength(" ".join(words[: taken + 1])) <= width:
            taken += 1
        lines.append(fit_line(" ".join(words[:taken]), face, width))
        words = words[taken:]
    return [*lines, fit_line(" ".join(words), face, width)] if words else lines


def _longest_beginning(text: str, face: Font, width: float) -> str:
    """Return the longest beginning that leaves room for the ellipsis."""
    lengths = range(1, len(text) + 1)
    n = bisect_right(lengths, width, key=lambda n: face.getlength(text[:n].rstrip() + _MORE))
    return text[:n].rstrip()
