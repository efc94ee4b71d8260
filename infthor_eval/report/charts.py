"""A chart as a value: a page draws it as SVG (`report.svg`), a figure with matplotlib
(`report.figures`), and both have its numbers as a table."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

from infthor_eval.rates import Rate
from infthor_eval.tables import Column, Row, Table, interval_cell

# Okabe and Ito's colours, which colour-blind readers can tell apart, in an order in which
# neighbours differ in lightness too; without yellow (too faint for a line) and black (the bound's).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


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


class Point(NamedTuple):
    """A value with its 95 % interval (None: none), and of how many samples it is.

    `x` is its place on the axis, or the number of its class.
    """

    x: float
    mean: float
    low: float | None = None
    high: float | None = None
    n: int | None = None


class Series(NamedTuple):
    """A run, or whatever else has points of one look.

    Attributes:
        name: its name in the legend.
        points: its points, in the order of their places.
        place: number of its colour and shape.
        is_bound: whether it bounds the others.
    """

    name: str
    points: Sequence[Point]
    place: int = 0
    is_bound: bool = False


class Class(NamedTuple):
    """A class of samples, or a run, that each series has one value of.

    Attributes:
        label: what it is of.
        heading: what is written above it; empty for nothing.
        chance: value of the dashed line (`Chart.dashed`); None if it is not known.
        at: its place on the axis of a figure; None if it is no number.
    """

    label: str
    heading: str = ""
    chance: float | None = None
    at: float | None = None

    @property
    def full_label(self) -> str:
        """The heading, if there is one, and the label."""
        return ", ".join(filter(None, (self.heading, self.label)))


@dataclass(frozen=True)
class Chart:
    """A chart.

    Attributes:
        title: its heading.
        caption: how it is read, in a sentence.
        axes: what its classes or places are, and what its values measure, with their units.
        series: its series, from the first to the one on top.
        form: values of classes as rows of dots, or as a grid of cells; values over their cost on a
            log scale; or step functions.
        classes: the classes, from the top; none for series over numbers.
        dashed: what the dashed lines of the classes' `chance` are.
        limits: ends of the axis of values; in rows further values make it longer.
        words: its contents in words, for screen readers; empty for all values.
        missing: why there is no run in a figure's panel.
    """

    title: str
    caption: str
    axes: tuple[str, str]
    series: Sequence[Series]
    form: Literal["rows", "grid", "log", "steps"] = "rows"
    classes: Sequence[Class] = ()
    dashed: str = "blind"
    limits: tuple[float, float] = (0.0, 100.0)
    words: str = ""
    missing: str = ""

    @property
    def description(self) -> str:
        """The contents in words."""
        if self.words:
            return self.words
        if self.form == "steps":
            ends = (f"{one.name} {one.points[-1].mean:.1f}" for one in self.series)
            return f"at the end: {'; '.join(ends)}"
        return "; ".join(self._of_classes() if self.classes else map(_over_costs, self.series))

    def by_class(self) -> list[tuple[Class, list[Point | None]]]:
        """Return each class with the point of each series, None where it has none."""
        points = [{point.x: point for point in one.points} for one in self.series]
        found = []
        for number, row in enumerate(self.classes):
            found.append((row, [of_series.get(number) for of_series in points]))
        return found

    @property
    def table(self) -> Table:
        """All numbers of the chart."""
        names = 1  # columns that are no numbers
        if self.form == "grid":
            columns = (self.axes[0], *(one.name for one in self.series))
            rows = [
                (row.label, *("-" if it is None else f"{it.mean:.2f}" for it in points))
                for row, points in self.by_class()
            ]
        elif self.form == "rows":
            names = 2 if len(self.series) > 1 else 1
            numbers = (self.axes[1], "95 % interval", self.dashed, "samples")
            columns = (*(self.axes[0], "run")[:names], *numbers)
            rows = list(self._rows())
        else:
            digits = ".3f" if self.form == "steps" else ".2f"
            columns = ("curve" if self.form == "log" else "run", *self.axes, "95 % interval")
            rows = [
                (one.name, f"{x:g}", f"{mean:{digits}}", interval_cell(low, high, digits))
                for one in self.series
                for x, mean, low, high, _ in one.points
            ]
        heads = (Column(name, number >= names) for number, name in enumerate(columns))
        return Table("", tuple(heads), tuple(map(Row, rows)))

    def _of_classes(self) -> Iterator[str]:
        several = len(self.series) > 1
        for row, points in self.by_class():
            values = [
                f"{one.name} {point.mean:.1f}" if several else f"{point.mean:.1f}"
                for one, point in zip(self.series, points, strict=True)
                if point is not None
            ]
            yield f"{row.full_label} {', '.join(values) or 'none'}"

    def _rows(self) -> Iterator[tuple[str, ...]]:
        heading = ""
        for row, points in self.by_class():
            heading = row.heading or heading
            label = row._replace(heading=heading).full_label
            chance = "" if row.chance is None else f"{row.chance:.2f}"
            for one, point in zip(self.series, points, strict=True):
                if point is not None:
                    names = (label, one.name) if len(self.series) > 1 else (label,)
                    interval = interval_cell(point.low, point.high, ".2f")
                    n = "" if point.n is None else str(point.n)
                    yield (*names, f"{point.mean:.2f}", interval, chance, n)


def _over_costs(series: Series) -> str:
    return f"{series.name} " + ", ".join(f"{it.mean:.1f} at {it.x:,.4g}" for it in series.points)


def point_of(x: float, share: Estimate, n: int | None = None) -> Point:
    """Return the point of a share, in percent."""
    low, high = (None if end is None else 100 * end for end in (share.low, share.high))
    return Point(x, 100 * (share.mean or 0.0), low, high, n)


def class_series(
    name: str, place: int, classes: Sequence[str], rates: Mapping[str, Rate]
) -> Series:
    """Return the series of the shares of some classes, by their names."""
    points = [
        point_of(number, rates[of], rates[of].n) for number, of in enumerate(classes) if of in rates
    ]
    return Series(name, points, place)


def counted_classes(
    names: Sequence[str], series: Sequence[Series], chances: Sequence[float | None] | None = None
) -> list[Class]:
    """Return classes that have in parentheses the number of their samples: that which all series
    have, or the least and the most."""
    classes = []
    for number, name in enumerate(names):
        points = [point for one in series for point in one.points if point.x == number]
        counts = [point.n for point in points if point.n is not None]
        least = min(counts, default=0)
        most = max(counts, default=0)
        of = f"{least:,}" if least == most else f"{least:,} to {most:,}"
        classes.append(Class(f"{name} ({of})", chance=chances[number] if chances else None))
    return classes


@dataclass(frozen=True)
class Panels:
    """A row of a figure's panels.

    Attributes:
        title: its heading; empty for none.
        labels: names of its series in the legend; those of a bound are there in any case.
        charts: a chart for each column.
    """

    title: str
    labels: Sequence[str]
    charts: Sequence[Chart]
