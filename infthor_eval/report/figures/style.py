"""The style of all figures: colours and lines of runs, texts around panels, PNG and SVG files."""

import io
import re
import textwrap
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from infthor_eval.errors import wrap_errors
from infthor_eval.storage.files import write_atomically
from infthor_eval.terminal import printable

# Okabe and Ito's colours, which colour-blind readers can tell apart, without yellow (too faint for
# a line) and black (the bound's). Runs beyond their number take them again with another style of
# line; dashes are the bound's.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
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
# On a page, ink takes the page's colours, which matplotlib cannot write: these placeholders are
# replaced afterwards.
_INK = "#010203"
_GRID = "#040506"
_PAGE_SETTINGS: dict[Any, Any] = {
    **dict.fromkeys(
        ("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), _INK
    ),
    "grid.color": _GRID,
}
_PAGE_COLOURS = {
    _INK: "currentColor",
    _GRID: "var(--grid)",
    "#000000": "currentColor",
    "#444444": "currentColor",
}
_PER_INCH = 108  # pixels; letters are then as large as the page's
# The size of the svg element, which has a viewBox too.
_SIZE = re.compile(r' (?:width|height)="[^"]*"(?: (?:width|height)="[^"]*")?')
_TAG = re.compile(r"<[^>]*>")  # in texts matplotlib writes &lt; and &gt;
_STYLE = re.compile(r' style="([^"]*)"')
_SHEET = re.compile(r"\s*<style[^>]*>\*\{([^}]*)\}</style>")  # what all elements of a figure have
LEGEND = 2.3  # inches, beside the panels
_NAME = 30  # letters in a line of the legend
_LETTERS = 15  # letters of a note per inch


class Look(NamedTuple):
    """Colour, style and width of a line."""

    colour: str
    style: str
    width: float


BOUND = Look("black", "dashed", 1.4)


def looks_of(labels: Iterable[str], together: Iterable[Collection[str]] = ()) -> dict[str, Look]:
    """Return a look for each label of a run that is not the bound.

    Args:
        labels: labels of the runs.
        together: labels that share a panel; they have different colours as long as there are
            enough.
    """
    # The colours of one style of line, then those of the next.
    all_looks = [Look(colour, style, 1.5) for style in _STYLES for colour in _COLOURS]
    panels = list(together)
    looks = dict[str, Look]()
    for number, label in enumerate(dict.fromkeys(labels)):
        beside = {name for panel in panels if label in panel for name in panel}
        colours = {looks[name].colour for name in beside if name in looks}
        free = [look for look in all_looks if look not in looks.values()]
        apart = [look for look in free if look.colour not in colours]
        looks[label] = next(iter(apart or free), all_looks[number % len(all_looks)])
    return looks


def save_figure(draw: Callable[[], Figure], folder: Path, name: str) -> list[Path]:
    """Write a figure as PNG and SVG (equal bytes for equal figures) and return the files' paths.

    Args:
        draw: draws the figure; called with the style in effect.
        folder: folder of the files.
        name: name of the files, without suffix.

    Raises:
        DataError: a file cannot be written.
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


def inline_svg(draw: Callable[[], Figure]) -> str:
    """Return a figure for a page, in its colours (light or dark), no wider than its column."""
    with _in_style(_PAGE_SETTINGS):
        text = io.StringIO()
        figure = draw()
        figure.savefig(text, format="svg", transparent=True, metadata=_SVG_METADATA)
        width = figure.get_figwidth()
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    sheet = _SHEET.search(svg)
    inherited = "" if sheet is None else _as_attributes(sheet[1])
    svg = _SIZE.sub(f' width="{round(_PER_INCH * width)}"{inherited}', _SHEET.sub("", svg), count=1)
    return _TAG.sub(lambda tag: _for_page(tag[0]), svg)


def _for_page(tag: str) -> str:
    for colour, in_page in _PAGE_COLOURS.items():
        tag = tag.replace(colour, in_page)
    return _STYLE.sub(lambda style: _as_attributes(style[1]), tag)


def _as_attributes(declarations: str) -> str:
    """Return a style's declarations as attributes of an SVG element, each with a space before it.

    A page's policy lets no element have a style, since text could become one.
    """
    pairs = (part.partition(":") for part in declarations.split(";") if part.strip())
    last = {name.strip(): value.strip() for name, _, value in pairs}  # a later one holds
    return "".join(f' {name}="{value}"' for name, value in last.items())


@contextmanager
def _in_style(more: dict[Any, Any] | None = None) -> Iterator[None]:
    """Apply the style instead of the user's settings of matplotlib, which change the picture."""
    with matplotlib.rc_context(), warnings.catch_warnings():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS | (more or {}))
        # A name with letters that the font lacks: the PNG shows boxes, the SVG the letters.
        warnings.filterwarnings("ignore", "Glyph .* missing")
        yield


def _save(figure: Figure, path: Path, kind: str) -> Path:
    metadata = _SVG_METADATA if kind == "svg" else {}
    with (
        wrap_errors(f"{path}: cannot be written", "give another --out"),
        write_atomically(path) as partial,
    ):
        figure.savefig(partial, format=kind, dpi=160, metadata=metadata)
    return path


def add_legend(axes: Axes, entries: Sequence[tuple[str, Look]]) -> None:
    """Add a legend beside a panel: names with their lines."""
    handles = [
        Line2D([], [], color=look.colour, ls=look.style, lw=look.width) for _, look in entries
    ]
    names = ["\n".join(textwrap.wrap(printable(label), _NAME)) for label, _ in entries]
    axes.legend(
        handles, names, loc="upper left", bbox_to_anchor=(1.02, 1.0), frameon=False, borderaxespad=0
    )


def add_words(figure: Figure, heading: Sequence[str], notes: Sequence[str], width: float) -> None:
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
