"""Curves of reward as a figure; the same curves give the same bytes of SVG."""

from collections.abc import Mapping, Sequence
from functools import partial

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from infthor_eval.episodes.curves import Curve, Facet, RewardCurves, RunCurves
from infthor_eval.report.figures.curve_tables import Panel, embedded_label, trajectories_text
from infthor_eval.report.figures.style import (
    BOUND,
    LEGEND,
    Look,
    add_legend,
    add_words,
    looks_of,
)
from infthor_eval.terminal import printable

# inches; the width of one of many
_PANEL = (4.6, 2.7)
_NARROW = 3.5
_MARGIN = 1.1  # inches around the panels
_IN_THOUSANDS = 10_000  # end of an x axis from which its ticks are in thousands
_LINE = 0.2  # inches of a line of the legend


def curves_figure(curves: RewardCurves, panels: Sequence[Panel]) -> Figure:
    """Return a figure: a row per panel, with the bound in each, a column per facet of some run."""
    drawn = set().union(*(run.curves for run in curves.runs))
    facets = {name: facet for name, facet in curves.facets.items() if name in drawn}
    width = len(facets) * (_PANEL[0] if len(facets) < 3 else _NARROW) + LEGEND
    height = max(_PANEL[1], _LINE * (len(curves.runs) + 1))
    figure = Figure(figsize=(width, len(panels) * height + _MARGIN), layout="constrained")
    # One scale of reward for all panels, so that they can be compared.
    grid = figure.subplots(len(panels), len(facets), sharex="col", sharey=True, squeeze=False)
    bounds = {run.label: BOUND for run in curves.runs if run.is_bound}
    named = [label for panel in panels for label in panel.labels if label not in bounds]
    looks = bounds | looks_of(named, [panel.labels for panel in panels])
    for row, panel in zip(grid, panels, strict=True):
        runs = [run for run in curves.runs if run.is_bound or run.label in panel.labels]
        for axes, (name, facet) in zip(row, facets.items(), strict=True):
            _draw_panel(axes, name, facet, runs, looks)
        row[0].set_ylabel("reward so far (points)")
        row[0].set_title(printable(panel.title), loc="left", fontweight="bold")
        # The bound comes first: its line is drawn last and lies on top.
        labels = [*bounds, *(label for label in panel.labels if label not in bounds)]
        add_legend(row[-1], [(label, looks[label]) for label in labels])
    for top, bottom, facet in zip(grid[0], grid[-1], facets.values(), strict=True):
        bottom.set_xlabel(facet.over)
        if facet.title:
            top.set_title(facet.title)
    add_words(figure, _heading(curves), curves.notes, width)
    return figure


def _draw_panel(
    axes: Axes, name: str, facet: Facet, runs: Sequence[RunCurves], looks: Mapping[str, Look]
) -> None:
    for order, run in enumerate(runs, 3):  # above the grid; the bound, the last, on top
        if name in run.curves:
            _draw_curve(axes, run.curves[name], looks[run.label], order)
    if not any(name in run.curves for run in runs if not run.is_bound):
        axes.text(0.5, 0.5, facet.missing, transform=axes.transAxes, ha="center", color="gray")
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.xaxis.set_major_formatter(FuncFormatter(partial(_place_text, axes)))
    axes.tick_params(labelbottom=True)


def _place_text(axes: Axes, value: float, _: object) -> str:
    """Return the text of a tick: in thousands where the axis is that long, as the paper's are."""
    return (
        f"{value / 1_000:,g}K" if value and axes.get_xlim()[1] >= _IN_THOUSANDS else f"{value:,.0f}"
    )


def _draw_curve(axes: Axes, curve: Curve, look: Look, order: int) -> None:
    means = [estimate.mean for estimate in curve.means]
    axes.plot(
        curve.places,
        means,
        drawstyle="steps-post",
        color=look.colour,
        ls=look.style,
        lw=look.width,
        zorder=order,
    )
    # A dot marks the end: where contexts were cut, many plans end at the last place and the line
    # rises there.
    axes.plot(curve.places[-1:], means[-1:], marker="o", ms=3.5, color=look.colour, zorder=order)
    low = [
        mean if estimate.low is None else estimate.low
        for mean, estimate in zip(means, curve.means, strict=True)
    ]
    high = [
        mean if estimate.high is None else estimate.high
        for mean, estimate in zip(means, curve.means, strict=True)
    ]
    axes.fill_between(
        curve.places, low, high, step="post", color=look.colour, alpha=0.13, linewidth=0, zorder=2
    )


def _heading(curves: RewardCurves) -> list[str]:
    intervals = ", 95 % intervals shaded" if curves.n_trajectories > 1 else ""
    mean = f"mean over {trajectories_text(curves.n_trajectories)}{intervals}"
    # A line each: together they would be wider than a figure of one panel, and be wrapped in the
    # middle.
    return [f"Cumulative reward on {curves.task}", mean, *filter(None, [embedded_label(curves)])]
