"""Figures of charts with matplotlib, as those of the paper; equal charts give equal bytes of SVG.

To add a figure: its numbers in the suite's package, its charts in the suite's presenter, which
names it, its section in `docs/figures.md`.
"""

import textwrap
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from infthor_eval.report.charts import COLOURS, Chart, Panels, Series
from infthor_eval.storage.files import write_output
from infthor_eval.terminal import printable

# Runs beyond the number of colours take them again with another style of line; dashes are the
# bound's.
_STYLES = ("solid", "dotted", "dashdot")
_SETTINGS: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "text.parse_math": False,  # a name with two dollar signs is no formula
    "svg.fonttype": "none",  # texts stay texts: searchable and editable
    # otherwise ids of clip paths are random, and equal figures differ
    "svg.hashsalt": "infthor-eval",
}
_SVG_METADATA: dict[str, Any] = {"Date": None}  # a date would make equal figures differ
LEGEND = 2.3  # inches, beside the panels
_NAME = 30  # letters in a line of the legend
_LETTERS = 15  # letters of a note per inch
# inches; the width of one of many
_PANEL = (4.6, 2.7)
_NARROW = 3.5
_MARGIN = 1.1  # inches around the panels
_LINE = 0.2  # inches of a line of the legend
_IN_THOUSANDS = 10_000  # end of an x axis from which its ticks are in thousands
# Share of the distance of classes that the points of several runs are spread over; of numbers, that
# their intervals are, beside the points.
_SPREAD = 0.3
_SPREAD_OF_NUMBERS = 0.1


class Look(NamedTuple):
    """Colour, style and width of a line."""

    colour: str
    style: str
    width: float

    @property
    def line(self) -> dict[str, Any]:
        """It in matplotlib's words."""
        return {"color": self.colour, "ls": self.style, "lw": self.width}


_BOUND = Look("black", "dashed", 1.4)
_CHANCE = Look("#9a9a9a", "solid", 3.0)


def looks_of(labels: Iterable[str], together: Iterable[Collection[str]] = ()) -> dict[str, Look]:
    """Return a look for each label of a run that is not the bound.

    Args:
        labels: labels of the runs.
        together: labels that share a panel; they have different colours as long as there are
            enough.
    """
    # The colours of one style of line, then those of the next.
    all_looks = [Look(colour, style, 1.5) for style in _STYLES for colour in COLOURS]
    panels = list(together)
    looks = dict[str, Look]()
    for number, label in enumerate(dict.fromkeys(labels)):
        beside = {name for panel in panels if label in panel for name in panel}
        colours = {looks[name].colour for name in beside if name in looks}
        free = [look for look in all_looks if look not in looks.values()]
        apart = [look for look in free if look.colour not in colours]
        looks[label] = next(iter(apart or free), all_looks[number % len(all_looks)])
    return looks


def draw_figure(
    heading: Sequence[str], columns: Sequence[str], rows: Sequence[Panels], notes: Sequence[str]
) -> Figure:
    """Return a figure of charts in rows and columns of panels, with a legend beside each row.

    Args:
        heading: lines above the panels.
        columns: headings of the columns; empty for none.
        rows: the panels.
        notes: lines below them.
    """
    charts = [chart for row in rows for chart in row.charts]
    bounds = {one.name: _BOUND for chart in charts for one in chart.series if one.is_bound}
    named = [label for row in rows for label in row.labels if label not in bounds]
    looks = bounds | looks_of(named, [row.labels for row in rows])
    is_narrow = len(columns) > 2 and charts[0].form == "steps"
    width = len(columns) * (_NARROW if is_narrow else _PANEL[0]) + LEGEND
    height = max(_PANEL[1], _LINE * (len(looks) + 1))
    figure = Figure(figsize=(width, len(rows) * height + _MARGIN), layout="constrained")
    # One scale of values for all panels, so that they can be compared.
    grid = figure.subplots(len(rows), len(columns), sharex="col", sharey=True, squeeze=False)
    for axes_of_row, row in zip(grid, rows, strict=True):
        for axes, chart in zip(axes_of_row, row.charts, strict=True):
            (_draw_steps if chart.form == "steps" else _draw_classes)(axes, chart, looks)
        axes_of_row[0].set_ylabel(row.charts[0].axes[1])
        axes_of_row[0].set_title(printable(row.title), loc="left", fontweight="bold")
        # The bound comes first: its line is drawn last and lies on top.
        entries = [(label, looks[label]) for label in dict.fromkeys([*bounds, *row.labels])]
        dashed = [chart.dashed for chart in row.charts if _chances(chart)]
        add_legend(axes_of_row[-1], [*entries, *((name, _CHANCE) for name in dashed)])
    for top, bottom, title, chart in zip(grid[0], grid[-1], columns, rows[-1].charts, strict=True):
        bottom.set_xlabel(chart.axes[0])
        if title:
            top.set_title(title)
    _add_words(figure, heading, notes, width)
    return figure


def _chances(chart: Chart) -> list[tuple[float, float]]:
    """Return the places of the classes whose chance is known, with it."""
    pairs = zip(_places(chart), chart.classes, strict=True)
    return [(place, row.chance) for place, row in pairs if row.chance is not None]


def _places(chart: Chart) -> list[float]:
    return [number if row.at is None else row.at for number, row in enumerate(chart.classes)]


def _draw_classes(axes: Axes, chart: Chart, looks: Mapping[str, Look]) -> None:
    """Draw a line of each series over the classes, with intervals."""
    places = _places(chart)
    chances = _chances(chart)
    if chances:
        ends, heights = zip(*chances, strict=True)
        axes.fill_between(ends, heights, color=_CHANCE.colour, alpha=0.15, linewidth=0, zorder=1)
        axes.plot(ends, heights, **_CHANCE.line, zorder=2.5, marker="o", ms=5)
    has_names = all(row.at is None for row in chart.classes)
    # Points of several series would hide each other.
    spread = _SPREAD if has_names else _SPREAD_OF_NUMBERS
    apart = min((after - before for before, after in pairwise(places)), default=1.0)
    step = spread * apart / max(len(chart.series) - 1, 1)
    for order, series in enumerate(chart.series):
        look = looks[series.name]
        offset = step * (order - (len(chart.series) - 1) / 2)
        at = [places[int(it.x)] + (offset if has_names else 0.0) for it in series.points]
        means = [it.mean for it in series.points]
        axes.plot(at, means, **look.line, marker="o", ms=4, zorder=3)
        for point in series.points:
            if point.low is not None and point.high is not None:
                x = places[int(point.x)] + offset
                axes.vlines(x, point.low, point.high, color=look.colour, lw=1.2, zorder=2.8)
    if has_names:
        axes.set_xticks(places, [row.label.replace(" (", "\n(") for row in chart.classes])
        axes.grid(axis="x", visible=False)
    axes.set_ylim(min(-3.0, axes.get_ylim()[0]), 103)


def _draw_steps(axes: Axes, chart: Chart, looks: Mapping[str, Look]) -> None:
    for order, series in enumerate(chart.series, 3):  # above the grid; the bound, the last, on top
        _draw_curve(axes, series, looks[series.name], order)
    if all(one.is_bound for one in chart.series):
        axes.text(0.5, 0.5, chart.missing, transform=axes.transAxes, ha="center", color="gray")
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.xaxis.set_major_formatter(FuncFormatter(partial(_place_text, axes)))
    axes.tick_params(labelbottom=True)


def _place_text(axes: Axes, value: float, _: object) -> str:
    """Return the text of a tick: in thousands where the axis is that long, as the paper's are."""
    return (
        f"{value / 1_000:,g}K" if value and axes.get_xlim()[1] >= _IN_THOUSANDS else f"{value:,.0f}"
    )


def _draw_curve(axes: Axes, series: Series, look: Look, order: int) -> None:
    places = [point.x for point in series.points]
    means = [point.mean for point in series.points]
    axes.plot(places, means, drawstyle="steps-post", **look.line, zorder=order)
    # A dot marks the end: where contexts were cut, many plans end at the last place and the line
    # rises there.
    axes.plot(places[-1:], means[-1:], marker="o", ms=3.5, color=look.colour, zorder=order)
    low = [it.mean if it.low is None else it.low for it in series.points]
    high = [it.mean if it.high is None else it.high for it in series.points]
    axes.fill_between(
        places, low, high, step="post", color=look.colour, alpha=0.13, linewidth=0, zorder=2
    )


def save_figure(draw: Callable[[], Figure], folder: Path, name: str) -> list[Path]:
    """Write a figure as PNG and SVG (equal bytes for equal figures) and return the files' paths.

    Args:
        draw: draws the figure; called with the style in effect.
        folder: folder of the files.
        name: name of the files, without suffix.
    """
    with _in_style():
        figure = draw()
        return [_save(figure, folder / f"{name}.{kind}", kind) for kind in ("png", "svg")]


def plot_in_style(draw: Callable[[], Figure]) -> Figure:
    """Return a figure as the files of `save_figure` show it, for who goes on with it."""
    with _in_style():
        figure = draw()
        FigureCanvasAgg(figure)  # a notebook shows no figure without a canvas
        figure.draw_without_rendering()  # what is laid out and styled only when it is drawn
    return figure


@contextmanager
def _in_style() -> Iterator[None]:
    """Apply the style instead of the user's settings of matplotlib, which change the picture."""
    with matplotlib.rc_context(), warnings.catch_warnings():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS)
        # A name with letters that the font lacks: the PNG shows boxes, the SVG the letters.
        warnings.filterwarnings("ignore", "Glyph .* missing")
        yield


def _save(figure: Figure, path: Path, kind: str) -> Path:
    metadata = _SVG_METADATA if kind == "svg" else {}
    with write_output(path, "give another --out") as partial:
        figure.savefig(partial, format=kind, dpi=160, metadata=metadata)
    return path


def add_legend(axes: Axes, entries: Sequence[tuple[str, Look]]) -> None:
    """Add a legend beside a panel: names with their lines."""
    handles = [Line2D([], [], **look.line) for _, look in entries]
    names = ["\n".join(textwrap.wrap(printable(label), _NAME)) for label, _ in entries]
    axes.legend(
        handles, names, loc="upper left", bbox_to_anchor=(1.02, 1.0), frameon=False, borderaxespad=0
    )


def _add_words(figure: Figure, heading: Sequence[str], notes: Sequence[str], width: float) -> None:
    """Write the heading above the panels, and the notes below; `width` is the figure's, inches."""
    settings: dict[str, Any] = {"x": 0.01, "ha": "left"}
    wrapped = [
        part for line in heading for part in textwrap.wrap(printable(line), round(width * 12))
    ]
    figure.suptitle("\n".join(wrapped), fontsize=10, **settings)
    remarks = [
        part for note in notes for part in textwrap.wrap(printable(note), round(width * _LETTERS))
    ]
    if remarks:
        figure.supxlabel("\n".join(remarks), fontsize=8, color="#444444", **settings)
