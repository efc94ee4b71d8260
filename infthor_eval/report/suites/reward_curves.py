"""Curves of reward, and other figures of episodes, as sections of the page and as files."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from infthor_eval.episodes.curves import RewardCurves
from infthor_eval.errors import InfthorError
from infthor_eval.report.figures.curve_tables import curves_table, one_panel, read_panels
from infthor_eval.report.figures.curves import curves_figure
from infthor_eval.report.presenter import FigureResult
from infthor_eval.report.svg.curves import curves_charts
from infthor_eval.report.web.sections import Chart, Section
from infthor_eval.tables import Table


class DrawnFigure(NamedTuple):
    """A figure for the page: its charts, and the table of its numbers."""

    charts: Sequence[Chart]
    table: Table


def figure_section(key: str, title: str, build: Callable[[], DrawnFigure]) -> Section:
    """Return a section with charts and table, or why the runs cannot be drawn together."""
    try:
        drawn = build()
        return Section(key, title, tuple(drawn.charts), (drawn.table,))
    except InfthorError as error:
        return Section(key, title, notes=(f"not drawn: {error}",))


def curves_on_page(curves: RewardCurves) -> DrawnFigure:
    """Return the charts of some curves, one for each facet with all runs."""
    return DrawnFigure(list(curves_charts(curves)), curves_table(curves))


def curves_result(curves: RewardCurves, panels_file: Path | None) -> FigureResult:
    """Return the figure of some curves for `report --figure`, with the panels of a file."""
    panels = one_panel(curves) if panels_file is None else read_panels(panels_file, curves)
    drawn = {label for panel in panels for label in panel.labels}
    left_out = [run.label for run in curves.runs if not run.is_bound and run.label not in drawn]
    notes = (f"in no panel: {', '.join(left_out)}",) if left_out else ()
    return FigureResult(curves_table(curves), lambda: curves_figure(curves, panels), notes)
