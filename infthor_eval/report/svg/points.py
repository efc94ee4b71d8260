"""Values against what they cost: points, joined where they are of one curve, over a log scale."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from infthor_eval.report.svg.dots import Dot
from infthor_eval.report.svg.drawing import Series, draw_legend, marker, svg
from infthor_eval.report.svg.panel import Panel
from infthor_eval.report.web.sections import Chart
from infthor_eval.tables import Column, Row, Table, interval_cell

_LARGE = 1e6
_MOST_DECADES = 3  # with more, only powers of ten have a tick


class Point(NamedTuple):
    """What a value costs, above 0, and the value."""

    cost: float
    value: Dot


@dataclass(frozen=True)
class PointsChart:
    """Contents of a chart of points.

    Attributes:
        title: its heading.
        caption: how it is read, in a sentence.
        axes: what both axes measure, with their units: cost, value.
        curves: the points of each curve, by its name.
    """

    title: str
    caption: str
    axes: tuple[str, str]
    curves: Mapping[str, Sequence[Point]]


def points_chart(contents: PointsChart) -> Chart:
    """Draw a chart, with its numbers."""
    cost, value = contents.axes
    described = []
    rows = []
    for name, points in contents.curves.items():
        texts = [f"{point.value.mean:.1f} at {point.cost:,.4g}" for point in points]
        described.append(f"{name} {', '.join(texts)}")
        for at, dot in points:
            interval = interval_cell(dot.low, dot.high, ".2f")
            rows.append(Row((name, f"{at:.6g}", f"{dot.mean:.2f}", interval)))
    columns = (Column("curve", False), *map(Column, (cost, value, "95 % interval")))
    table = Table("", columns, tuple(rows))
    drawn = _draw(contents)
    return Chart(contents.title, drawn, "; ".join(described), contents.caption, table)


def _draw(contents: PointsChart) -> str:
    legend, top = draw_legend([Series(name, place) for place, name in enumerate(contents.curves)])
    costs = [math.log10(point.cost) for points in contents.curves.values() for point in points]
    margin = max(0.08 * (max(costs) - min(costs)), 0.05)
    ends = min(costs) - margin, max(costs) + margin
    panel = Panel(top + 10, ends, (0.0, 100.0))
    parts = [*legend, *panel.axes(*contents.axes, _log_ticks(*ends))]
    for place, (name, points) in enumerate(contents.curves.items()):
        parts += _curve(panel, Series(name, place), points)
    return svg(panel.height, parts)


def _curve(panel: Panel, series: Series, points: Sequence[Point]) -> Iterator[str]:
    places = [(math.log10(point.cost), point.value.mean) for point in points]
    yield from panel.line(places, stroke=series.colour, stroke_width=1.5)
    for (x, y), (cost, dot) in zip(places, points, strict=True):
        yield from panel.span(x, dot.low, dot.high, series.colour)
        yield marker(series, panel.x(x), panel.y(y), f"{series.name}: {y:.1f} at {cost:,.4g}")


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
