"""Values with intervals as dots in rows: runs, or the classes of samples, one below the other."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from infthor_eval.report.svg.drawing import (
    LETTER,
    LINE,
    WIDTH,
    Series,
    draw_legend,
    element,
    marker,
    svg,
    text,
    ticks_between,
    wrap,
)
from infthor_eval.report.web.sections import Chart
from infthor_eval.tables import Column, Row, Table, interval_cell

_DOT = 13  # pixels between the dots of several runs in a row
_NARROW = 6  # the same where there are so many that none has its number beside it
_MOST_NUMBERS = 8
_GAP = 9  # pixels between rows
_NUMBER = 46  # pixels for a value as a number
_WIDEST = 0.42  # share of the width that labels may take
_MARGIN = 4


class Estimate(Protocol):
    """A mean with its interval, as shares."""

    @property
    def mean(self) -> float | None:
        """The mean."""

    @property
    def low(self) -> float | None:
        """The interval's lower end; None if there is none."""

    @property
    def high(self) -> float | None:
        """Its upper end."""


class Dot(NamedTuple):
    """A value in percent with its 95 % interval (None: none), and of how many samples it is."""

    mean: float
    low: float | None = None
    high: float | None = None
    n: int | None = None


class DotRow(NamedTuple):
    """A row of a chart.

    Attributes:
        label: what the row is of.
        dots: a dot for each series; None where it has no value.
        chance: what `blind` scores (`DotsChart.dashed`), in percent; None if it is not known.
        heading: what is written above the row; empty for nothing.
    """

    label: str
    dots: Sequence[Dot | None]
    chance: float | None = None
    heading: str = ""


def class_row(name: str, dots: Sequence[Dot | None], chance: float | None = None) -> DotRow:
    """Return the row of a class of samples, with their number in parentheses."""
    counts = [dot.n for dot in dots if dot is not None and dot.n is not None]
    return DotRow(f"{name} ({number_range(counts)})", dots, chance)


def number_range(counts: Sequence[int]) -> str:
    """Return a number that all have, or the least and the most: runs may have different ones."""
    least, most = min(counts, default=0), max(counts, default=0)
    return f"{least:,}" if least == most else f"{least:,} to {most:,}"


@dataclass(frozen=True)
class DotsChart:
    """Contents of a chart of dots.

    Attributes:
        title: its heading.
        caption: how it is read, in a sentence.
        axis: what the axis measures, with its unit.
        label: what the rows are of, for the table of numbers.
        series: the runs, or whatever has dots of one look; of several each has its name in the
            legend.
        rows: the rows, from the top.
        dashed: what the dashed lines of the rows' `chance` are.
        limits: ends of the axis; further values make it longer.
        description: its contents in words; empty for the values of all rows.
    """

    title: str
    caption: str
    axis: str
    label: str
    series: Sequence[Series]
    rows: Sequence[DotRow]
    dashed: str = "blind"
    limits: tuple[float, float] = (0.0, 100.0)
    description: str = ""


def dot_of(estimate: Estimate, n: int | None = None) -> Dot:
    """Return the dot of a share."""
    low, high = (None if end is None else 100 * end for end in (estimate.low, estimate.high))
    return Dot(100 * (estimate.mean or 0.0), low, high, n)


def dots_chart(contents: DotsChart) -> Chart:
    """Draw a chart, with its numbers."""
    table = _table(contents)
    words = contents.description or "; ".join(_describe(contents))
    return Chart(contents.title, _Drawing(contents).svg(), words, contents.caption, table)


def _describe(contents: DotsChart) -> Iterator[str]:
    for row in contents.rows:
        values = [
            f"{series.name} {dot.mean:.1f}" if len(contents.series) > 1 else f"{dot.mean:.1f}"
            for series, dot in zip(contents.series, row.dots, strict=True)
            if dot is not None
        ]
        yield f"{', '.join(filter(None, (row.heading, row.label)))} {', '.join(values) or 'none'}"


def _table(contents: DotsChart) -> Table:
    """Return the numbers of a chart, with a row for each dot."""
    several = len(contents.series) > 1
    rows = []
    heading = ""
    for row in contents.rows:
        heading = row.heading or heading
        label = ", ".join(filter(None, (heading, row.label)))
        for series, dot in zip(contents.series, row.dots, strict=True):
            if dot is None:
                continue
            chance = "" if row.chance is None else f"{row.chance:.2f}"
            n = "" if dot.n is None else str(dot.n)
            interval = interval_cell(dot.low, dot.high, ".2f")
            names = (label, series.name) if several else (label,)
            rows.append(Row((*names, f"{dot.mean:.2f}", interval, chance, n)))
    columns = [Column(contents.label, False)]
    if several:
        columns.append(Column("run", False))
    numbers = (contents.axis, "95 % interval", contents.dashed, "samples")
    return Table("", (*columns, *map(Column, numbers)), tuple(rows))


class _Drawing:
    """Draws a chart of dots from the top down."""

    def __init__(self, contents: DotsChart) -> None:
        self._contents = contents
        self._legend = contents.series if len(contents.series) > 1 else ()
        self._step = _DOT if len(contents.series) <= _MOST_NUMBERS else _NARROW
        longest = max((len(row.label) for row in contents.rows), default=0)
        self._left = min(LETTER * longest + 10, _WIDEST * WIDTH)
        self._right = WIDTH - _NUMBER - _MARGIN
        self._low, self._high = self._limits()

    def _limits(self) -> tuple[float, float]:
        values = list(self._contents.limits)
        for row in self._contents.rows:
            for dot in row.dots:
                if dot is not None:
                    values += [end for end in (dot.mean, dot.low, dot.high) if end is not None]
        return min(values), max(values)

    def _x(self, value: float) -> float:
        share = (value - self._low) / ((self._high - self._low) or 1.0)
        return self._left + _MARGIN + share * (self._right - self._left - 2 * _MARGIN)

    def svg(self) -> str:
        has_chance = any(row.chance is not None for row in self._contents.rows)
        parts, y = draw_legend(self._legend, self._contents.dashed if has_chance else "")
        y += _GAP
        top = y
        rows: list[str] = []
        for row in self._contents.rows:
            if row.heading:
                for line in wrap(row.heading, WIDTH):
                    rows.append(text(0, y + LINE / 2, line, font_weight=600))
                    y += LINE
                y += 3
            drawn, height = self._row(row, y)
            rows += drawn
            y += height + _GAP
        return svg(y + 2.6 * LINE, [*parts, *self._axis(top, y), *rows])

    def _axis(self, top: float, bottom: float) -> Iterator[str]:
        for tick in ticks_between(self._low, self._high):
            x = self._x(tick)
            is_zero = tick == 0 and self._low < 0
            colour = "currentColor" if is_zero else "var(--grid)"
            yield element("line", x1=x, x2=x, y1=top - 4, y2=bottom, stroke=colour)
            yield text(x, bottom + LINE / 2 + 2, f"{tick:g}", text_anchor="middle")
        middle = (self._left + self._right) / 2
        # Beneath a narrow axis a long name goes to the left, where there is room.
        half = LETTER * len(self._contents.axis) / 2
        middle = min(max(middle, half), WIDTH - half) if 2 * half < WIDTH else WIDTH / 2
        yield text(middle, bottom + 1.6 * LINE + 4, self._contents.axis, text_anchor="middle")

    def _row(self, row: DotRow, y: float) -> tuple[list[str], float]:
        lines = wrap(row.label, self._left - 10)
        height = max(LINE * len(lines), self._step * len(row.dots) + 3)
        start = y + (height - LINE * len(lines)) / 2 + LINE / 2
        parts = [text(0, start + number * LINE, line) for number, line in enumerate(lines)]
        if row.chance is not None:
            x = self._x(row.chance)
            line = {"stroke": "currentColor", "stroke_width": 1.5, "stroke_dasharray": "4 3"}
            about = element("title", f"{self._contents.dashed} {row.chance:.1f}")
            parts.append(element("line", about, x1=x, x2=x, y1=y, y2=y + height, **line))
        first = y + height / 2 - self._step * (len(row.dots) - 1) / 2
        for number, (series, dot) in enumerate(zip(self._contents.series, row.dots, strict=True)):
            if dot is not None:
                parts += self._dot(series, dot, first + self._step * number, row.label)
            elif len(row.dots) == 1:
                parts.append(text(WIDTH, first, "none", text_anchor="end", opacity=0.8))
        return parts, height

    def _dot(self, series: Series, dot: Dot, y: float, label: str) -> Iterator[str]:
        interval = ""
        if dot.low is not None and dot.high is not None:
            interval = f" ({dot.low:.1f} to {dot.high:.1f})"
            span = {"stroke": series.colour, "stroke_width": 2}
            yield element("line", x1=self._x(dot.low), x2=self._x(dot.high), y1=y, y2=y, **span)
        count = "" if dot.n is None else f", {dot.n} samples"
        name = ", ".join(filter(None, (series.name, label)))
        yield marker(series, self._x(dot.mean), y, f"{name}: {dot.mean:.1f}{interval}{count}")
        if self._step == _DOT:
            yield text(WIDTH, y, f"{dot.mean:.1f}", text_anchor="end", font_size=12)
