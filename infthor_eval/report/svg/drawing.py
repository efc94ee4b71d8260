"""What the charts of the page are made of: elements, lines of text, marks, legends, ticks."""

import math
import textwrap
from collections.abc import Iterator, Sequence
from html import escape
from typing import NamedTuple

from infthor_eval.terminal import printable

WIDTH = 480  # pixels of all charts; a phone shows 390
LINE = 16  # pixels of a line of text
LETTER = 7.2  # pixels of a letter at most, on average
_MARKER = 4.2  # half the width of a mark
_STEPS = (1, 2, 2.5, 5, 10)
_MOST_TICKS = 6
# Okabe and Ito's colours, which colour-blind readers can tell apart, in an order in which
# neighbours differ in lightness too. Each has a shape of its own, for prints without colours.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_SHAPES = ("circle", "square", "diamond", "up", "down")


class Series(NamedTuple):
    """A run, or whatever else has marks of one look; its name is empty if it needs no legend."""

    name: str
    place: int = 0

    @property
    def colour(self) -> str:
        """The colour of its marks."""
        return _COLOURS[self.place % len(_COLOURS)]

    @property
    def shape(self) -> str:
        """The shape of its marks."""
        return _SHAPES[self.place % len(_SHAPES)]


def element(name: str, content: str = "", /, **attributes: object) -> str:
    """Return an element: attributes have hyphens for underscores, and numbers are rounded."""
    pairs = "".join(
        f' {key.strip("_").replace("_", "-")}="{_value(value)}"'
        for key, value in attributes.items()
    )
    return f"<{name}{pairs}>{content}</{name}>"


def _value(value: object) -> str:
    return f"{value:.1f}".removesuffix(".0") if isinstance(value, float) else escape(str(value))


def svg(height: float, parts: Sequence[str]) -> str:
    """Return the chart of some elements."""
    return element(
        "svg",
        "".join(parts),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {WIDTH} {height:.0f}",
        width=WIDTH,
        font_family="system-ui, 'DejaVu Sans', sans-serif",
        font_size=13,
        fill="currentColor",
    )


def text(x: float, y: float, words: str, **attributes: object) -> str:
    """Return a line of text; `y` is the middle of its letters."""
    return element("text", escape(printable(words)), x=x, y=y + 4.5, **attributes)


def wrap(words: str, width: float) -> list[str]:
    """Return the lines of a text that are at most that many pixels wide; no letter is lost."""
    return textwrap.wrap(printable(words), max(4, int(width / LETTER))) or [""]


def marker(series: Series, x: float, y: float, about: str) -> str:
    """Return the mark of a value; `about` is shown to whoever points at it."""
    m = _MARKER
    content = element("title", escape(printable(about))) if about else ""
    colour = series.colour
    if series.shape == "circle":
        return element("circle", content, cx=x, cy=y, r=m, fill=colour)
    if series.shape == "square":
        return element("rect", content, x=x - m, y=y - m, width=2 * m, height=2 * m, fill=colour)
    corners = {
        "diamond": ((0, -m - 1), (m + 1, 0), (0, m + 1), (-m - 1, 0)),
        "up": ((0, -m - 1), (m + 1, m), (-m - 1, m)),
        "down": ((0, m + 1), (m + 1, -m), (-m - 1, -m)),
    }[series.shape]
    points = " ".join(f"{x + dx:.1f},{y + dy:.1f}" for dx, dy in corners)
    return element("polygon", content, points=points, fill=colour)


def draw_legend(
    series: Sequence[Series], dashed: str = "", solid: str = ""
) -> tuple[list[str], float]:
    """Return the elements of a legend at the top, and its height: marks of series, then lines."""
    parts: list[str] = []
    x = 0.0
    y = LINE / 2
    keys: list[tuple[str, Series | None, str]] = [(one.name, one, "") for one in series if one.name]
    keys += [(name, None, dash) for name, dash in ((dashed, "4 3"), (solid, "")) if name]
    for name, one, dash in keys:
        lines = wrap(name, WIDTH - 24)
        width = 24 + LETTER * max(map(len, lines)) + 14
        if x and x + width > WIDTH:
            x = 0.0
            y += LINE
        if one is not None:
            parts.append(marker(one, x + 8, y, ""))
        else:
            line = {"stroke": "currentColor", "stroke_width": 1.5, "stroke_dasharray": dash}
            parts.append(element("line", x1=x + 8, x2=x + 8, y1=y - 7, y2=y + 7, **line))
        for number, words in enumerate(lines):
            parts.append(text(x + 20, y + number * LINE, words))
        y += (len(lines) - 1) * LINE
        x = WIDTH if len(lines) > 1 else x + width
    return parts, y + LINE if keys else 0.0


def ticks_between(low: float, high: float) -> Iterator[float]:
    """Yield round numbers from low to high, six at most."""
    span = (high - low) / (_MOST_TICKS - 1) or 1.0
    power = 10.0 ** math.floor(math.log10(span))
    step = next(step * power for step in _STEPS if step * power >= span * 0.999)
    for number in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1):
        yield number * step
