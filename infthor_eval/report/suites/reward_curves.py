"""Curves of reward: their charts for the page and for figures 6 and 7, their table, and notes."""

from collections.abc import Callable, Collection, Sequence
from functools import partial
from pathlib import Path

from infthor_eval.episodes.curves import RewardCurves, RunCurves
from infthor_eval.errors import DataError, InfthorError
from infthor_eval.formats.yaml_files import read_yaml
from infthor_eval.report.charts import Chart, Panels, Point, Series
from infthor_eval.report.presenter import FigureResult
from infthor_eval.report.web.sections import Section
from infthor_eval.run import unmarked
from infthor_eval.tables import Column, Row, Table, interval_cell

_MOST_PANELS = 12  # a figure with more cannot be read
_COLUMNS = ("reward", "95 % interval", "of the bound, %")
_CAPTION = (
    "Higher is better: a line is the reward that a run has earned so far, on average over "
    "trajectories, with its 95 % interval shaded; the dashed line is the upper bound."
)


def figure_section(
    key: str, title: str, build: Callable[[], tuple[Sequence[Chart], Table]]
) -> Section:
    """Return a section with charts and table, or why the runs cannot be drawn together."""
    try:
        charts, table = build()
        return Section(key, title, tuple(charts), (table,))
    except InfthorError as error:
        return Section(key, title, notes=(f"not drawn: {error}",))


def curves_on_page(curves: RewardCurves) -> tuple[Sequence[Chart], Table]:
    """Return the chart of each facet that some run has a curve of, and the table."""
    return one_panel(curves)[0].charts, curves_table(curves)


def curves_result(curves: RewardCurves, panels_file: Path | None) -> FigureResult:
    """Return the figure of some curves for `report --figure`, with the panels of a file."""
    # Loads matplotlib, which the page does without.
    from infthor_eval.report.figures import draw_figure

    panels = one_panel(curves) if panels_file is None else read_panels(panels_file, curves)
    drawn = {label for panel in panels for label in panel.labels}
    left_out = [run.label for run in curves.runs if not run.is_bound and run.label not in drawn]
    notes = (f"in no panel: {', '.join(left_out)}",) if left_out else ()
    titles = [curves.facets[name].title for name in _drawn(curves)]
    plot = partial(draw_figure, _heading(curves), titles, panels, curves.notes)
    return FigureResult(curves_table(curves), plot, notes)


def one_panel(curves: RewardCurves) -> list[Panels]:
    """Return one row of panels with all runs."""
    return [_panels(curves, "", tuple(run.label for run in curves.runs))]


def read_panels(path: Path, curves: RewardCurves) -> list[Panels]:
    """Read panels from a YAML file: titles, each with a list of runs by their names in the
    table."""
    fix = "write titles, each with a list of runs (docs/figures.md)"
    panels = read_yaml(path, fix)
    if not isinstance(panels, dict) or not panels:
        raise DataError(f"{path}: not a mapping; {fix}")
    if len(panels) > _MOST_PANELS:
        raise DataError(
            f"{path}: {len(panels)} panels, and a figure takes {_MOST_PANELS}; write several files"
        )
    return [_panel(path, str(title), named, curves) for title, named in panels.items()]


def _panel(path: Path, title: str, named: object, curves: RewardCurves) -> Panels:
    if not isinstance(named, list) or not named:
        raise DataError(f"{path}: {title!r:.60} is not a list of runs; write their names")
    labels = {unmarked(run.label): run.label for run in curves.runs}
    names = [unmarked(str(name)) for name in named]
    for name in names:
        if name not in labels:
            raise DataError(
                f"{path}: {title!r:.60}: {name!r:.60} is none of the runs; there are "
                f"{', '.join(labels)}"
            )
    return _panels(curves, title, tuple(labels[name] for name in dict.fromkeys(names)))


def _drawn(curves: RewardCurves) -> list[str]:
    """Return the facets that some run has a curve of."""
    return [name for name in curves.facets if any(name in run.curves for run in curves.runs)]


def _panels(curves: RewardCurves, title: str, labels: Sequence[str]) -> Panels:
    return Panels(title, labels, [_chart(curves, name, labels) for name in _drawn(curves)])


def _chart(curves: RewardCurves, name: str, labels: Collection[str]) -> Chart:
    """Return the chart of a facet of some runs and the bound, which is the last."""
    facet = curves.facets[name]
    series = []
    for place, run in enumerate(curves.runs):
        if name in run.curves and (run.is_bound or run.label in labels):
            curve = run.curves[name]
            points = [
                Point(at, it.mean, it.low, it.high)
                for at, it in zip(curve.places, curve.means, strict=True)
            ]
            series.append(Series(run.label, points, place, run.is_bound))
    title = facet.title or f"Reward over {facet.over}"
    axes = (facet.over, "reward so far (points)")
    return Chart(title, _CAPTION, axes, series, "steps", missing=facet.missing)


def embedded_label(curves: RewardCurves) -> str | None:
    """Return the note on runs in the embedded simulator; None if there are none."""
    return embedded_note(
        [run.label for run in curves.runs if run.is_embedded], len(curves.runs), "curves"
    )


def embedded_note(labels: Sequence[str], n_labels: int, what: str) -> str | None:
    """Return the note on numbers of the embedded simulator; None if there are none.

    Args:
        labels: labels of the runs in it.
        n_labels: number of all labels.
        what: the paper's numbers that these are not comparable with, in the plural.
    """
    if not labels:
        return None
    which = "" if len(labels) == n_labels else f" ({', '.join(labels)})"
    return f"embedded simulator{which}: not comparable with the paper's {what}"


def curves_table(curves: RewardCurves) -> Table:
    """Return a table of the ends of the curves, with a row per run."""
    bound = next(run for run in curves.runs if run.is_bound).curves[curves.main].end.mean
    facets = curves.facets.values()
    earned = [facet.earned for facet in facets if facet.earned is not None]
    end_at = [facet.end_at for facet in facets if facet.end_at is not None]
    columns = (
        Column("run", False),
        *map(Column, (*_COLUMNS, *earned, *end_at, *curves.runs[0].counts)),
    )
    label = embedded_label(curves)
    notes = ((label,) if label else ()) + curves.notes
    title = (
        f"{curves.task}: reward at the end, mean over {trajectories_text(curves.n_trajectories)}"
    )
    return Table(title, columns, tuple(_row(run, bound, curves) for run in curves.runs), notes)


def trajectories_text(count: int) -> str:
    """Return the number of trajectories in words."""
    return "1 trajectory" if count == 1 else f"{count} trajectories"


def _row(run: RunCurves, bound: float, curves: RewardCurves) -> Row:
    end = run.curves[curves.main].end
    interval = interval_cell(end.low, end.high, ".2f")
    share = f"{100 * end.mean / bound:.1f}" if bound > 0 else "-"
    curves_of_run = [(facet, run.curves.get(name)) for name, facet in curves.facets.items()]
    earned = (
        "-" if curve is None else f"{curve.end.mean:.2f}"
        for facet, curve in curves_of_run
        if facet.earned
    )
    last_places = (
        "-" if curve is None else f"{curve.places[-1]:.0f}"
        for facet, curve in curves_of_run
        if facet.end_at
    )
    return Row(
        (
            run.label,
            f"{end.mean:.2f}",
            interval,
            share,
            *earned,
            *last_places,
            *map(str, run.counts.values()),
        )
    )


def _heading(curves: RewardCurves) -> list[str]:
    intervals = ", 95 % intervals shaded" if curves.n_trajectories > 1 else ""
    mean = f"mean over {trajectories_text(curves.n_trajectories)}{intervals}"
    # A line each: together they would be wider than a figure of one panel, and be wrapped in the
    # middle.
    return [f"Cumulative reward on {curves.task}", mean, *filter(None, [embedded_label(curves)])]
