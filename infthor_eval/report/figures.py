"""Curves of reward as a picture, in PNG and SVG; the same curves give the same bytes of SVG."""

import textwrap
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from infthor_eval.agents.curves import Axis, Curve, RewardCurves, RunCurves
from infthor_eval.errors import naming
from infthor_eval.formats.files import written_atomically
from infthor_eval.report.curves import Panel, embedded_label, trajectories_told
from infthor_eval.terminal import shown

__all__ = ["draw_curves"]

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
_TITLES = {
    Axis.STEPS: "expert's steps up to the end of the plan (low-level actions)",
    Axis.TOKENS: "context of the plan's last request (tokens)",
}
_REWARD = "reward so far (points)"
_PANEL = (4.6, 2.7)  # inches
_LEGEND, _MARGIN = 2.3, 1.1  # inches beside and around the panels
_LINE = 0.2  # inches of a line of the legend
_NAME = 30  # letters of a line in the legend
_LETTERS = 15  # of a note, on an inch


class _Look(NamedTuple):
    colour: str
    style: str
    width: float


_BOUND = _Look("black", "dashed", 1.4)


def draw_curves(curves: RewardCurves, panels: Sequence[Panel], folder: Path, name: str) -> list[Path]:
    """Draw a row per panel: reward over steps, and beside it over context tokens where a run tells of them.

    Args:
        curves: what is drawn.
        panels: which runs stand together; the bound is in all of them.
        folder: takes the files.
        name: of the files, without what stands behind the dot.

    Returns:
        The files.

    Raises:
        DataError: a file cannot be written.
    """
    # Not what the user's own settings of matplotlib say: they would change the picture.
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS)
        figure = _figure(curves, panels)
        return [_saved(figure, folder / f"{name}.{form}", form) for form in ("png", "svg")]


def _saved(figure: Figure, path: Path, form: str) -> Path:
    metadata = {"Date": None} if form == "svg" else {}
    with (
        naming(f"{path}: cannot be written", "give another --out"),
        written_atomically(path) as partial,
        warnings.catch_warnings(),
    ):
        # Of a name in letters that the font lacks, the PNG has boxes; the SVG has the letters.
        warnings.filterwarnings("ignore", "Glyph .* missing")
        figure.savefig(partial, format=form, dpi=160, metadata=metadata)
    return path


def _figure(curves: RewardCurves, panels: Sequence[Panel]) -> Figure:
    axes = [axis for axis in Axis if any(axis in run.curves for run in curves.runs)]
    width = len(axes) * _PANEL[0] + _LEGEND
    height = max(_PANEL[1], _LINE * (len(curves.runs) + 1))
    figure = Figure(figsize=(width, len(panels) * height + _MARGIN), layout="constrained")
    # One scale of reward for all panels, so that they can be held against each other.
    grid = figure.subplots(len(panels), len(axes), sharex="col", sharey=True, squeeze=False)
    looks = _looks(curves.runs)
    for row, panel in zip(grid, panels, strict=True):
        runs = [run for run in curves.runs if run.is_bound or run.label in panel.labels]
        for place, axis in zip(row, axes, strict=True):
            _draw_panel(place, axis, runs, looks)
        row[0].set_ylabel(_REWARD)
        row[0].set_title(shown(panel.title), loc="left", fontweight="bold")
        _add_legend(row[-1], runs, looks)
    for place, axis in zip(grid[-1], axes, strict=True):
        place.set_xlabel(_TITLES[axis])
    _add_words(figure, curves, width)
    return figure


def _looks(runs: Sequence[RunCurves]) -> dict[str, _Look]:
    """One look per run in all panels."""
    looks = {run.label: _BOUND for run in runs}
    for number, run in enumerate(run for run in runs if not run.is_bound):
        style = _STYLES[number // len(_COLOURS) % len(_STYLES)]
        looks[run.label] = _Look(_COLOURS[number % len(_COLOURS)], style, 1.5)
    return looks


def _draw_panel(place: Axes, axis: Axis, runs: Sequence[RunCurves], looks: Mapping[str, _Look]) -> None:
    for order, run in enumerate(runs, 3):  # above the grid; the bound, the last, on top
        if axis in run.curves:
            _draw_curve(place, run.curves[axis], looks[run.label], order)
    if not any(axis in run.curves for run in runs):
        place.text(0.5, 0.5, "context tokens are not told", transform=place.transAxes, ha="center", color="gray")
    place.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    place.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    place.tick_params(labelbottom=True)


def _draw_curve(place: Axes, curve: Curve, look: _Look, order: int) -> None:
    means = [estimate.mean for estimate in curve.means]
    place.plot(
        curve.places, means, drawstyle="steps-post", color=look.colour, ls=look.style, lw=look.width, zorder=order
    )
    # A dot ends it: where contexts were cut, the rewards of many plans stand above each other in the last place.
    place.plot(curve.places[-1:], means[-1:], marker="o", ms=3.5, color=look.colour, zorder=order)
    low = [mean if estimate.low is None else estimate.low for mean, estimate in zip(means, curve.means, strict=True)]
    high = [mean if estimate.high is None else estimate.high for mean, estimate in zip(means, curve.means, strict=True)]
    place.fill_between(curve.places, low, high, step="post", color=look.colour, alpha=0.13, linewidth=0, zorder=2)


def _add_legend(place: Axes, runs: Sequence[RunCurves], looks: Mapping[str, _Look]) -> None:
    """Beside the panel, the bound first, as it lies on top."""
    named = [run.label for run in reversed(runs) if run.is_bound] + [run.label for run in runs if not run.is_bound]
    handles = [_handle(looks[label]) for label in named]
    names = ["\n".join(textwrap.wrap(shown(label), _NAME)) for label in named]
    place.legend(handles, names, loc="upper left", bbox_to_anchor=(1.02, 1.0), frameon=False, borderaxespad=0)


def _handle(look: _Look) -> Line2D:
    return Line2D([], [], color=look.colour, ls=look.style, lw=look.width)


def _add_words(figure: Figure, curves: RewardCurves, width: float) -> None:
    told = trajectories_told(curves.n_trajectories)
    title = f"Cumulative reward on {curves.task}: mean over {told}" + (
        ", 95 % intervals shaded" if curves.n_trajectories > 1 else ""
    )
    lines = [title, *filter(None, [embedded_label(curves)])]
    settings: dict[str, Any] = {"x": 0.01, "ha": "left"}
    wrapped = [part for line in lines for part in textwrap.wrap(shown(line), round(width * 12))]
    figure.suptitle("\n".join(wrapped), fontsize=10, **settings)
    notes = [part for note in curves.notes for part in textwrap.wrap(shown(note), round(width * _LETTERS))]
    if notes:
        figure.supxlabel("\n".join(notes), fontsize=8, color="#444444", **settings)
