"""Curves of reward on the page: a chart for each facet, with all runs."""

from collections.abc import Iterator, Sequence

from infthor_eval.episodes.curves import Curve, RewardCurves, RunCurves
from infthor_eval.report.svg.drawing import Series, draw_legend, element, marker, svg, ticks_between
from infthor_eval.report.svg.panel import Panel
from infthor_eval.report.web.sections import Chart
from infthor_eval.tables import Column, Row, Table, interval_cell

_CAPTION = (
    "Higher is better: a line is the reward that a run has earned so far, on average over "
    "trajectories, with its 95 % interval shaded; the dashed line is the upper bound."
)
_Named = Sequence[tuple[str, Curve, Series | None]]  # the bound has no series


def curves_charts(curves: RewardCurves) -> Iterator[Chart]:
    """Yield the chart of each facet that some run has a curve of."""
    models = [run for run in curves.runs if not run.is_bound]
    series = {run.label: Series(run.label, place) for place, run in enumerate(models)}
    for name, facet in curves.facets.items():
        named = [
            (run.label, run.curves[name], series.get(run.label))
            for run in (*models, *_bounds(curves))
            if name in run.curves
        ]
        if not named:
            continue
        title = facet.title or f"Reward over {facet.over}"
        described = "; ".join(f"{label} {curve.end.mean:.1f}" for label, curve, _ in named)
        drawn = _draw(named, facet.over)
        table = _table(named, facet.over)
        yield Chart(title, drawn, f"at the end: {described}", _CAPTION, table)


def _bounds(curves: RewardCurves) -> list[RunCurves]:
    return [run for run in curves.runs if run.is_bound]


def _draw(named: _Named, over: str) -> str:
    bound = next((label for label, _, series in named if series is None), "")
    legend, top = draw_legend([series for _, _, series in named if series], bound)
    values = [0.0]
    for _, curve, _ in named:
        for mean in curve.means:
            values += [end for end in (mean.mean, mean.low, mean.high) if end is not None]
    last = max(curve.places[-1] for _, curve, _ in named)
    panel = Panel(top + 10, (0.0, last or 1.0), (min(values), max(values) or 1.0))
    ticks = ((tick, f"{tick:,g}") for tick in ticks_between(*panel.x_ends))
    parts = [*legend, *panel.axes(over, "reward so far (points)", ticks)]
    for label, curve, series in named:
        parts += _line(panel, label, curve, series)
    return svg(panel.height, parts)


def _line(panel: Panel, label: str, curve: Curve, series: Series | None) -> Iterator[str]:
    means = [mean.mean for mean in curve.means]
    if series is None:
        dashed = {"stroke": "currentColor", "stroke_width": 1.5, "stroke_dasharray": "4 3"}
        yield from panel.line(_steps(curve.places, means), **dashed)
        return
    lows = [mean.mean if mean.low is None else mean.low for mean in curve.means]
    highs = [mean.mean if mean.high is None else mean.high for mean in curve.means]
    around = [*_steps(curve.places, highs), *reversed(_steps(curve.places, lows))]
    corners = " ".join(f"{panel.x(x):.1f},{panel.y(y):.1f}" for x, y in around)
    yield element("polygon", points=corners, fill=series.colour, fill_opacity=0.13)
    yield from panel.line(_steps(curve.places, means), stroke=series.colour, stroke_width=1.6)
    end = panel.x(curve.places[-1]), panel.y(means[-1])
    yield marker(series, *end, f"{label}: {means[-1]:.1f} at the end")


def _steps(places: Sequence[float], values: Sequence[float]) -> list[tuple[float, float]]:
    """Return the corners of a function that is constant between places."""
    corners = [(places[0], values[0])]
    for place, before, value in zip(places[1:], values, values[1:], strict=False):
        if value != before:  # what stays the same needs no corner
            corners += [(place, before), (place, value)]
    return [*corners, (places[-1], values[-1])]


def _table(named: _Named, over: str) -> Table:
    rows = [
        Row((label, f"{place:g}", f"{mean.mean:.3f}", interval_cell(mean.low, mean.high, ".3f")))
        for label, curve, _ in named
        for place, mean in zip(curve.places, curve.means, strict=True)
    ]
    columns = (Column("run", False), *map(Column, (over, "reward", "95 % interval")))
    return Table("", columns, tuple(rows))
