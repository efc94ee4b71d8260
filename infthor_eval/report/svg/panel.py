"""A panel with two axes, its ticks and labels."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from infthor_eval.report.svg.drawing import LETTER, LINE, WIDTH, element, text, ticks_between

_HEIGHT = 230  # pixels
_LEFT = 52
_RIGHT = WIDTH - 14


@dataclass(frozen=True)
class Panel:
    """A panel below a legend.

    Attributes:
        top: pixels above it.
        x_ends: first and last value of the x axis.
        y_ends: first and last value of the y axis.
    """

    top: float
    x_ends: tuple[float, float]
    y_ends: tuple[float, float]

    @property
    def height(self) -> float:
        """Height of a chart with the panel at its end, in pixels."""
        return self.top + _HEIGHT + 3 * LINE

    def x(self, value: float) -> float:
        """Return the pixel of a value on the x axis."""
        low, high = self.x_ends
        return _LEFT + (value - low) / ((high - low) or 1.0) * (_RIGHT - _LEFT)

    def y(self, value: float) -> float:
        """Return the pixel of a value on the y axis."""
        low, high = self.y_ends
        return self.top + (high - value) / ((high - low) or 1.0) * _HEIGHT

    def span(self, x: float, low: float | None, high: float | None, colour: str) -> Iterator[str]:
        """Yield the line of an interval, if there is one."""
        if low is not None and high is not None:
            place = self.x(x)
            line = {"stroke": colour, "stroke_width": 1.5}
            yield element("line", x1=place, x2=place, y1=self.y(low), y2=self.y(high), **line)

    def line(self, points: Sequence[tuple[float, float]], **attributes: object) -> Iterator[str]:
        """Yield the line through some points, if there are several."""
        if len(points) > 1:
            corners = " ".join(f"{self.x(x):.1f},{self.y(y):.1f}" for x, y in points)
            yield element("polyline", points=corners, fill="none", **attributes)

    def axes(
        self, x_label: str, y_label: str, x_ticks: Iterable[tuple[float, str]]
    ) -> Iterator[str]:
        """Yield both axes: ticks of x are given with their words, those of y are round numbers."""
        bottom = self.top + _HEIGHT
        for tick in ticks_between(*self.y_ends):
            y = self.y(tick)
            yield element("line", x1=_LEFT, x2=_RIGHT, y1=y, y2=y, stroke="var(--grid)")
            yield text(_LEFT - 6, y, f"{tick:,g}", text_anchor="end")
        end = 0.0  # of the last tick's words: none is written over another
        for tick, words in x_ticks:
            x = self.x(tick)
            yield element("line", x1=x, x2=x, y1=self.top, y2=bottom, stroke="var(--grid)")
            half = LETTER * len(words) / 2
            if x - half > end:
                place = min(x, WIDTH - half)
                yield text(place, bottom + LINE / 2 + 2, words, text_anchor="middle")
                end = x + half
        middle = (_LEFT + _RIGHT) / 2
        yield text(middle, bottom + 1.6 * LINE + 4, x_label, text_anchor="middle")
        middle = self.top + _HEIGHT / 2
        turned = f"rotate(-90 8 {middle:.1f})"
        yield text(8, middle, y_label, text_anchor="middle", transform=turned)
