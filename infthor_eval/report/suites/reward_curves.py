"""Curves of reward, and other figures of episodes, as sections of the page and as files."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from infthor_eval.episodes.curves import RewardCurves
from infthor_eval.errors import InfthorError
from infthor_eval.report.figures.curve_tables import curves_table, one_panel, read_panels
from infthor_eval.report.figures.curves import curves_figure
from infthor_eval.report.figures.style import inline_svg
from infthor_eval.report.presenter import FigureResult
from infthor_eval.report.web.sections import Chart, Section
from infthor_eval.tables import Table

__all__ = ["DrawnFigure", "curves_on_page", "curves_result", "figure_section"]


class DrawnFigure(NamedTuple):
    """A figure for the page: a function that draws it, its numbers, and its contents in words."""

    draw: Callable[[], Figure]
    table: Table
    description: str


def figure_section(key: str, title: str, build: Callable[[], DrawnFigure]) -> Section:
    """Return a section with figure and table, or why the runs cannot be drawn together."""
    try:
        drawn = build()
        return Section(
            key, title, (Chart(title, inline_svg(drawn.draw), drawn.description),), (drawn.table,)
        )
    except InfthorError as error:
        return Section(key, title, notes=(f"not drawn: {error}",))


def curves_on_page(curves: RewardCurves) -> DrawnFigure:
    """Return the figure of some curves, all of them in one panel."""
    ends = (
        f"{run.label} {run.curves[curves.main].end.mean:.1f}"
        for run in curves.runs
        if curves.main in run.curves
    )
    description = "at the end: " + "; ".join(ends)
    return DrawnFigure(
        lambda: curves_figure(curves, one_panel(curves)), curves_table(curves), description
    )


def curves_result(curves: RewardCurves, panels_file: Path | None) -> FigureResult:
    """Return the figure of some curves for `report --figure`, with the panels of a file."""
    panels = one_panel(curves) if panels_file is None else read_panels(panels_file, curves)
    drawn = {label for panel in panels for label in panel.labels}
    left_out = [run.label for run in curves.runs if not run.is_bound and run.label not in drawn]
    notes = (f"in no panel: {', '.join(left_out)}",) if left_out else ()
    return FigureResult(curves_table(curves), lambda: curves_figure(curves, panels), notes)
