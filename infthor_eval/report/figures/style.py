"""What all figures have in common: their style, the looks of runs, words around panels, files in PNG and SVG."""

import io
import re
import textwrap
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from infthor_eval.errors import wrap_errors
from infthor_eval.formats.files import write_atomically
from infthor_eval.terminal import printable

__all__ = ["BOUND", "LEGEND", "Look", "add_legend", "add_words", "inline_svg", "looks_of", "save_figure"]

# Okabe and Ito's colours, which the colour-blind tell apart, but for yellow, too faint for a line, and black, which is
# the bound's. Runs beyond their number take them again in another style of line; dashes are the bound's alone.
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
    "svg.fonttype": "none",  # texts that can be found and edited
    "svg.hashsalt": "infthor-eval",  # without it the names of clips are drawn by chance
}
_OF_SVG: dict[str, Any] = {"Date": None}  # equal figures are equal files
# In a page, ink takes the page's colours: these stand for them until the figure is written.
_INK, _GRID = "#010203", "#040506"
_OF_PAGE: dict[Any, Any] = {
    **dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), _INK),
    "grid.color": _GRID,
}
_PAGE_COLOURS = {_INK: "currentColor", _GRID: "var(--grid)", "#000000": "currentColor", "#444444": "currentColor"}
_PER_INCH = 108  # pixels of a page, so that letters are as large as the page's own
_SIZE = re.compile(r' (?:width|height)="[^"]*"(?: (?:width|height)="[^"]*")?')  # of the figure; it has a viewBox too
LEGEND = 2.3  # inches beside the panels
_NAME = 30  # letters of a line in the legend
_LETTERS = 15  # of a note, on an inch


class Look(NamedTuple):
    """How a line looks."""

    colour: str
    style: str
    width: float


BOUND = Look("black", "dashed", 1.4)


def looks_of(labels: Iterable[str]) -> dict[str, Look]:
    """A look for each of some lines that are no bound."""
    looks = {}
    for number, label in enumerate(labels):
        style = _STYLES[number // len(_COLOURS) % len(_STYLES)]
        looks[label] = Look(_COLOURS[number % len(_COLOURS)], style, 1.5)
    return looks


def save_figure(make: Callable[[], Figure], folder: Path, name: str) -> list[Path]:
    """Write a figure as PNG and SVG; the same figure gives the same bytes of SVG.

    Args:
        make: makes it, in the style of all of them.
        folder: takes the files.
        name: of the files, without what stands behind the dot.

    Returns:
        The files.

    Raises:
        DataError: a file cannot be written.
    """
    with _in_style():
        figure = make()
        return [_saved(figure, folder / f"{name}.{form}", form) for form in ("png", "svg")]


def inline_svg(make: Callable[[], Figure]) -> str:
    """A figure as an element of a page: its ink is the page's own, light or dark, and it shrinks with its room.

    Args:
        make: makes it, in the style of all of them.
    """
    with _in_style(_OF_PAGE):
        written, figure = io.StringIO(), make()
        figure.savefig(written, format="svg", transparent=True, metadata=_OF_SVG)
        width = figure.get_figwidth()
    svg = written.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = _SIZE.sub(rf' style="max-width: {round(_PER_INCH * width)}px"', svg, count=1)
    for colour, in_page in _PAGE_COLOURS.items():
        svg = svg.replace(colour, in_page)
    return svg


@contextmanager
def _in_style(more: dict[Any, Any] | None = None) -> Iterator[None]:
    """Not what the user's own settings of matplotlib say: they would change the picture."""
    with matplotlib.rc_context(), warnings.catch_warnings():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS | (more or {}))
        # Of a name in letters that the font lacks, the PNG has boxes; the SVG has the letters.
        warnings.filterwarnings("ignore", "Glyph .* missing")
        yield


def _saved(figure: Figure, path: Path, form: str) -> Path:
    metadata = _OF_SVG if form == "svg" else {}
    with wrap_errors(f"{path}: cannot be written", "give another --out"), write_atomically(path) as partial:
        figure.savefig(partial, format=form, dpi=160, metadata=metadata)
    return path


def add_legend(place: Axes, entries: Sequence[tuple[str, Look]]) -> None:
    """Beside a panel: names, each with its line."""
    handles = [Line2D([], [], color=look.colour, ls=look.style, lw=look.width) for _, look in entries]
    names = ["\n".join(textwrap.wrap(printable(label), _NAME)) for label, _ in entries]
    place.legend(handles, names, loc="upper left", bbox_to_anchor=(1.02, 1.0), frameon=False, borderaxespad=0)


def add_words(figure: Figure, heading: Sequence[str], notes: Sequence[str], width: float) -> None:
    """Above the panels what they show, and beneath them what must be said of it.

    Args:
        figure: the figure.
        heading: lines.
        notes: lines.
        width: of the figure, inches.
    """
    settings: dict[str, Any] = {"x": 0.01, "ha": "left"}
    wrapped = [part for line in heading for part in textwrap.wrap(printable(line), round(width * 12))]
    figure.suptitle("\n".join(wrapped), fontsize=10, **settings)
    told = [part for note in notes for part in textwrap.wrap(printable(note), round(width * _LETTERS))]
    if told:
        figure.supxlabel("\n".join(told), fontsize=8, color="#444444", **settings)
