"""Charts of the page as SVG elements: in its colours, and readable at the width of a phone.

matplotlib draws the figures of the paper (`report.figures`). A page has many charts, and an index
of runs has hundreds: these take a millisecond each, and their letters keep their size.
"""

import math
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

from infthor_eval.report.charts import COLOURS, Chart, Class, Point, Series
from infthor_eval.terminal import printable

WIDTH = 480  # pixels of all charts; a phone shows 390
LETTER = 7.2  # pixels of a letter at most, on average
_LINE = 16  # pixels of a line of text
_MARKER = 4.2  # half the width of a mark
_SHAPES = ("circle", "square", "diamond", "up", "down")  # for prints without colours
_DASHED = {"stroke": "currentColor", "stroke_width": 1.5, "stroke_dasharray": "4 3"}
_STEPS = (1, 2, 2.5, 5, 10)
_MOST_TICKS = 6
# Of rows: pixels between the dots of several series, and where there are so many that none has its
# number beside it; between rows; for a value as a number; the share of the width for labels.
_DOT = 13
_NARROW = 6
_MOST_NUMBERS = 8
_GAP = 9
_NUMBER = 46
_WIDEST = 0.42
_MARGIN = 4
# Of a panel, in pixels.
_HEIGHT = 230
_LEFT = 52
_RIGHT = WIDTH - 14
_LARGE = 1e6
_MOST_DECADES = 3  # with more, only powers of ten have a tick
# Of a grid: pixels of a cell's height, and its colours from 0 to 100: one hue, as colour-blind
# readers and prints tell its values apart by lightness alone.
_CELL = 34
_PALE = (247, 251, 255)
_DARK = (8, 64, 129)


def draw(chart: Chart) -> str:
    """Return a chart as an SVG element."""
    if chart.form == "grid":
        return _draw_grid(chart)
    if chart.form == "rows":
        return _Rows(chart).svg()
    return _draw_costs(chart) if chart.form == "log" else _draw_steps(chart)


def _element(name: str, content: str = "", /, **attributes: object) -> str:
    """Return an element: attributes have hyphens for underscores, and numbers are rounded."""
    pairs = "".join(
        f' {key.strip("_").replace("_", "-")}="{_value(value)}"'
        for key, value in attributes.items()
    )
    return f"<{name}{pairs}>{content}</{name}>"


def _value(value: object) -> str:
    return f"{value:.1f}".removesuffix(".0") if isinstance(value, float) else escape(str(value))


def _svg(height: float, parts: Sequence[str]) -> str:
    """Return the chart of some elements."""
    return _element(
        "svg",
        "".join(parts),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {WIDTH} {height:.0f}",
        width=WIDTH,
        font_family="system-ui, 'DejaVu Sans', sans-serif",
        font_size=13,
        fill="currentColor",
    )


def _text(x: float, y: float, words: str, **attributes: object) -> str:
    """Return a line of text; `y` is the middle of its letters."""
    return _element("text", escape(printable(words)), x=x, y=y + 4.5, **attributes)


def _wrap(words: str, width: float) -> list[str]:
    """Return the lines of a text that are at most that many pixels wide; no letter is lost."""
    return textwrap.wrap(printable(words), max(4, int(width / LETTER))) or [""]


def _colour(series: Series) -> str:
    return COLOURS[series.place % len(COLOURS)]


def _marker(series: Series, x: float, y: float, about: str) -> str:
    """Return the mark of a value; `about` is shown to whoever points at it."""
    m = _MARKER
    content = _element("title", escape(printable(about))) if about else ""
    colour = _colour(series)
    shape = _SHAPES[series.place % len(_SHAPES)]
    if shape == "circle":
        return _element("circle", content, cx=x, cy=y, r=m, fill=colour)
    if shape == "square":
        return _element("rect", content, x=x - m, y=y - m, width=2 * m, height=2 * m, fill=colour)
    corners = {
        "diamond": ((0, -m - 1), (m + 1, 0), (0, m + 1), (-m - 1, 0)),
        "up": ((0, -m - 1), (m + 1, m), (-m - 1, m)),
        "down": ((0, m + 1), (m + 1, -m), (-m - 1, -m)),
    }[shape]
    points = " ".join(f"{x + dx:.1f},{y + dy:.1f}" for dx, dy in corners)
    return _element("polygon", content, points=points, fill=colour)


def _draw_legend(series: Sequence[Series], dashed: str = "") -> tuple[list[str], float]:
    """Return the elements of a legend at the top, and its height: marks of series, then dashes."""
    parts: list[str] = []
    x = 0.0
    y = _LINE / 2
    keys: list[tuple[str, Series | None]] = [(one.name, one) for one in series if one.name]
    keys += [(dashed, None)] if dashed else []
    for name, one in keys:
        lines = _wrap(name, WIDTH - 24)
        width = 24 + LETTER * max(map(len, lines)) + 14
        if x and x + width > WIDTH:
            x = 0.0
            y += _LINE
        if one is not None:
            parts.append(_marker(one, x + 8, y, ""))
        else:
            parts.append(_element("line", x1=x + 8, x2=x + 8, y1=y - 7, y2=y + 7, **_DASHED))
        for number, words in enumerate(lines):
            parts.append(_text(x + 20, y + number * _LINE, words))
        y += (len(lines) - 1) * _LINE
        x = WIDTH if len(lines) > 1 else x + width
    return parts, y + _LINE if keys else 0.0


def ticks_between(low: float, high: float) -> Iterator[float]:
    """Yield round numbers from low to high, six at most."""
    span = (high - low) / (_MOST_TICKS - 1) or 1.0
    power = 10.0 ** math.floor(math.log10(span))
    step = next(step * power for step in _STEPS if step * power >= span * 0.999)
    for number in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1):
        yield number * step


class _Rows:
    """Draws values of classes as dots in rows, from the top down."""

    def __init__(self, chart: Chart) -> None:
        self._chart = chart
        self._legend = chart.series if len(chart.series) > 1 else ()
        self._step = _DOT if len(chart.series) <= _MOST_NUMBERS else _NARROW
        longest = max((len(row.label) for row in chart.classes), default=0)
        self._left = min(LETTER * longest + 10, _WIDEST * WIDTH)
        self._right = WIDTH - _NUMBER - _MARGIN
        values = [*chart.limits, *_values(chart)]
        self._low = min(values)
        self._high = max(values)

    def _x(self, value: float) -> float:
        share = (value - self._low) / ((self._high - self._low) or 1.0)
        return self._left + _MARGIN + share * (self._right - self._left - 2 * _MARGIN)

    def svg(self) -> str:
        has_chance = any(row.chance is not None for row in self._chart.classes)
        parts, y = _draw_legend(self._legend, self._chart.dashed if has_chance else "")
        y += _GAP
        top = y
        rows: list[str] = []
        for row, points in self._chart.by_class():
            if row.heading:
                for line in _wrap(row.heading, WIDTH):
                    rows.append(_text(0, y + _LINE / 2, line, font_weight=600))
                    y += _LINE
                y += 3
            drawn, height = self._row(row, points, y)
            rows += drawn
            y += height + _GAP
        return _svg(y + 2.6 * _LINE, [*parts, *self._axis(top, y), *rows])

    def _axis(self, top: float, bottom: float) -> Iterator[str]:
        for tick in ticks_between(self._low, self._high):
            x = self._x(tick)
            is_zero = tick == 0 and self._low < 0
            colour = "currentColor" if is_zero else "var(--grid)"
            yield _element("line", x1=x, x2=x, y1=top - 4, y2=bottom, stroke=colour)
            yield _text(x, bottom + _LINE / 2 + 2, f"{tick:g}", text_anchor="middle")
        name = self._chart.axes[1]
        middle = (self._left + self._right) / 2
        # Beneath a narrow axis a long name goes to the left, where there is room.
        half = LETTER * len(name) / 2
        middle = min(max(middle, half), WIDTH - half) if 2 * half < WIDTH else WIDTH / 2
        yield _text(middle, bottom + 1.6 * _LINE + 4, name, text_anchor="middle")

    def _row(self, row: Class, points: Sequence[Point | None], y: float) -> tuple[list[str], float]:
        lines = _wrap(row.label, self._left - 10)
        height = max(_LINE * len(lines), self._step * len(points) + 3)
        start = y + (height - _LINE * len(lines)) / 2 + _LINE / 2
        parts = [_text(0, start + number * _LINE, line) for number, line in enumerate(lines)]
        if row.chance is not None:
            x = self._x(row.chance)
            about = _element("title", f"{self._chart.dashed} {row.chance:.1f}")
            parts.append(_element("line", about, x1=x, x2=x, y1=y, y2=y + height, **_DASHED))
        first = y + height / 2 - self._step * (len(points) - 1) / 2
        for number, (series, point) in enumerate(zip(self._chart.series, points, strict=True)):
            if point is not None:
                parts += self._dot(series, point, first + self._step * number, row.label)
            elif len(points) == 1:
                parts.append(_text(WIDTH, first, "none", text_anchor="end", opacity=0.8))
        return parts, height

    def _dot(self, series: Series, dot: Point, y: float, label: str) -> Iterator[str]:
        interval = ""
        if dot.low is not None and dot.high is not None:
            interval = f" ({dot.low:.1f} to {dot.high:.1f})"
            span = {"stroke": _colour(series), "stroke_width": 2}
            yield _element("line", x1=self._x(dot.low), x2=self._x(dot.high), y1=y, y2=y, **span)
        count = "" if dot.n is None else f", {dot.n} samples"
        name = ", ".join(filter(None, (series.name, label)))
        yield _marker(series, self._x(dot.mean), y, f"{name}: {dot.mean:.1f}{interval}{count}")
        if self._step == _DOT:
            yield _text(WIDTH, y, f"{dot.mean:.1f}", text_anchor="end", font_size=12)


def _values(chart: Chart) -> Iterator[float]:
    """Yield all values, and the ends of their intervals."""
    for series in chart.series:
        for _, *ends, _ in series.points:
            yield from (end for end in ends if end is not None)


def _draw_grid(chart: Chart) -> str:
    """Draw values of classes as cells, darker where they are higher, a column for each series."""
    names = [chart.axes[0], *(row.label for row in chart.classes)]
    left = LETTER * max(map(len, names)) + 10
    width = (WIDTH - left) / len(chart.series)
    parts = [_text(0, _LINE / 2, chart.axes[0])]
    for number, series in enumerate(chart.series):
        x = left + (number + 0.5) * width
        parts.append(_text(x, _LINE / 2, series.name, text_anchor="middle"))
    for number, (row, points) in enumerate(chart.by_class()):
        y = _LINE + 4 + number * _CELL
        parts.append(_text(0, y + _CELL / 2, row.label))
        for column, (series, point) in enumerate(zip(chart.series, points, strict=True)):
            x = left + column * width
            value = 0.0 if point is None else point.mean
            words = "-" if point is None else f"{value:.0f}"
            about = escape(printable(f"{row.label}, {series.name}: {words}"))
            cell = {"width": width - 1, "height": _CELL - 1, "fill": _shade(min(value / 100, 1.0))}
            parts.append(_element("rect", _element("title", about), x=x, y=y, **cell))
            ink = "white" if value > 60 else "#222222"
            parts.append(_text(x + width / 2, y + _CELL / 2, words, text_anchor="middle", fill=ink))
    bottom = _LINE + 4 + len(chart.classes) * _CELL
    middle = (left + WIDTH) / 2
    parts.append(_text(middle, bottom + _LINE, chart.axes[1], text_anchor="middle"))
    return _svg(bottom + 2 * _LINE, parts)


def _shade(share: float) -> str:
    mixed = (round(pale + share * (dark - pale)) for pale, dark in zip(_PALE, _DARK, strict=True))
    return "#" + "".join(f"{part:02x}" for part in mixed)


@dataclass(frozen=True)
class _Panel:
    """A panel with two axes, below a legend.

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
        return self.top + _HEIGHT + 3 * _LINE

    def x(self, value: float) -> float:
        """Return the pixel of a value on the x axis."""
        low, high = self.x_ends
        return _LEFT + (value - low) / ((high - low) or 1.0) * (_RIGHT - _LEFT)

    def y(self, value: float) -> float:
        """Return the pixel of a value on the y axis."""
        low, high = self.y_ends
        return self.top + (high - value) / ((high - low) or 1.0) * _HEIGHT

    def corners(self, points: Iterable[tuple[float, float]]) -> str:
        """Return the pixels of some points."""
        return " ".join(f"{self.x(x):.1f},{self.y(y):.1f}" for x, y in points)

    def line(self, points: Sequence[tuple[float, float]], **attributes: object) -> Iterator[str]:
        """Yield the line through some points, if there are several."""
        if len(points) > 1:
            yield _element("polyline", points=self.corners(points), fill="none", **attributes)

    def axes(self, names: tuple[str, str], x_ticks: Iterable[tuple[float, str]]) -> Iterator[str]:
        """Yield both axes: ticks of x are given with their words, those of y are round numbers."""
        bottom = self.top + _HEIGHT
        for tick in ticks_between(*self.y_ends):
            y = self.y(tick)
            yield _element("line", x1=_LEFT, x2=_RIGHT, y1=y, y2=y, stroke="var(--grid)")
            yield _text(_LEFT - 6, y, f"{tick:,g}", text_anchor="end")
        end = 0.0  # of the last tick's words: none is written over another
        for tick, words in x_ticks:
            x = self.x(tick)
            yield _element("line", x1=x, x2=x, y1=self.top, y2=bottom, stroke="var(--grid)")
            half = LETTER * len(words) / 2
            if x - half > end:
                place = min(x, WIDTH - half)
                yield _text(place, bottom + _LINE / 2 + 2, words, text_anchor="middle")
                end = x + half
        middle = (_LEFT + _RIGHT) / 2
        yield _text(middle, bottom + 1.6 * _LINE + 4, names[0], text_anchor="middle")
        middle = self.top + _HEIGHT / 2
        turned = f"rotate(-90 8 {middle:.1f})"
        yield _text(8, middle, names[1], text_anchor="middle", transform=turned)


def _draw_costs(chart: Chart) -> str:
    """Draw values over what they cost, joined where they are of one series, over a log scale."""
    legend, top = _draw_legend(chart.series)
    costs = [math.log10(point.x) for series in chart.series for point in series.points]
    margin = max(0.08 * (max(costs) - min(costs)), 0.05)
    ends = min(costs) - margin, max(costs) + margin
    panel = _Panel(top + 10, ends, chart.limits)
    parts = [*legend, *panel.axes(chart.axes, _log_ticks(*ends))]
    for series in chart.series:
        colour = _colour(series)
        places = [(math.log10(point.x), point.mean) for point in series.points]
        parts += panel.line(places, stroke=colour, stroke_width=1.5)
        for (x, y), point in zip(places, series.points, strict=True):
            if point.low is not None and point.high is not None:
                ends_y = {"y1": panel.y(point.low), "y2": panel.y(point.high)}
                span = {"stroke": colour, "stroke_width": 1.5}
                parts.append(_element("line", x1=panel.x(x), x2=panel.x(x), **ends_y, **span))
            about = f"{series.name}: {y:.1f} at {point.x:,.4g}"
            parts.append(_marker(series, panel.x(x), panel.y(y), about))
    return _svg(panel.height, parts)


def _log_ticks(low: float, high: float) -> list[tuple[float, str]]:
    """Return powers of ten, with their numbers in words: of 1, 2 and 5 of each decade if there are
    few."""
    decades = range(math.floor(low), math.ceil(high) + 1)
    digits = (1, 2, 5) if high - low < _MOST_DECADES else (1,)
    ticks = [digit * 10.0**decade for decade in decades for digit in digits]
    known = [tick for tick in ticks if low <= math.log10(tick) <= high]
    ticks = known or [10 ** ((low + high) / 2)]
    return [
        (math.log10(tick), f"{tick:,.4g}" if tick < _LARGE else f"{tick:.0e}") for tick in ticks
    ]


def _draw_steps(chart: Chart) -> str:
    """Draw step functions with their intervals shaded; that of a bound is dashed."""
    bound = next((one.name for one in chart.series if one.is_bound), "")
    legend, top = _draw_legend([one for one in chart.series if not one.is_bound], bound)
    values = [0.0, *_values(chart)]
    last = max(one.points[-1].x for one in chart.series)
    panel = _Panel(top + 10, (0.0, last or 1.0), (min(values), max(values) or 1.0))
    ticks = ((tick, f"{tick:,g}") for tick in ticks_between(*panel.x_ends))
    parts = [*legend, *panel.axes(chart.axes, ticks)]
    for series in chart.series:
        parts += _steps(panel, series)
    return _svg(panel.height, parts)


def _steps(panel: _Panel, series: Series) -> Iterator[str]:
    points = series.points
    line = _corners([(point.x, point.mean) for point in points])
    if series.is_bound:
        yield from panel.line(line, **_DASHED)
        return
    lows = [(it.x, it.mean if it.low is None else it.low) for it in points]
    highs = [(it.x, it.mean if it.high is None else it.high) for it in points]
    around = panel.corners([*_corners(highs), *reversed(_corners(lows))])
    yield _element("polygon", points=around, fill=_colour(series), fill_opacity=0.13)
    yield from panel.line(line, stroke=_colour(series), stroke_width=1.6)
    end = points[-1]
    about = f"{series.name}: {end.mean:.1f} at the end"
    yield _marker(series, panel.x(end.x), panel.y(end.mean), about)


def _corners(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the corners of a function that is constant between places."""
    corners = [points[0]]
    for (_, before), (place, value) in pairwise(points):
        if value != before:  # what stays the same needs no corner
            corners += [(place, before), (place, value)]
    return [*corners, points[-1]]
