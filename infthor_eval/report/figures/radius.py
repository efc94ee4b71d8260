"""Success by the radius of the hand's sphere, as a figure and as a table."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from infthor_eval.manipulation.kinds import KIND_NAMES, ManipulationKind
from infthor_eval.manipulation.recorded.radii import RadiusLine, SuccessByRadius
from infthor_eval.rates import Rate, format_percent
from infthor_eval.report.figures.curve_tables import embedded_note, trajectories_text
from infthor_eval.report.figures.style import (
    BOUND,
    LEGEND,
    Look,
    add_legend,
    add_words,
    looks_of,
)
from infthor_eval.report.svg.dots import DotRow, DotsChart, dot_of, dots_chart
from infthor_eval.report.svg.drawing import Series
from infthor_eval.report.web.sections import Chart
from infthor_eval.tables import Column, Row, Table

_FLOOR = "in the sphere at the start"
_FLOOR_LOOK = Look("#9a9a9a", "solid", 3.0)
_OFFSET = 0.004  # metres between the intervals of two lines
# inches
_PANEL = (4.4, 2.9)
_MARGIN = 1.1
_LINE = 0.2


def radii_table(success: SuccessByRadius) -> Table:
    """Return a table with a row per model and kind and a column per radius."""
    all_points = (success.floor, *(line.points for line in success.lines))
    radii = sorted({radius for points in all_points for radius, _ in points})
    rows = [_row(line.label, line.kind, line.points, radii) for line in success.lines]
    if success.floor:
        rows.append(_row(f"({_FLOOR})", ManipulationKind.PICKUP, success.floor, radii))
    names = (*(f"{radius:g} m" for radius in radii), "episodes")
    columns = (Column("model", False), Column("kind", False), *map(Column, names))
    title = f"{success.task}: success by radius, %, of {trajectories_text(success.n_trajectories)}"
    return Table(title, columns, tuple(rows), (*_label(success), *success.notes))


def _row(
    label: str,
    kind: ManipulationKind,
    points: Sequence[tuple[float, Rate]],
    radii: Sequence[float],
) -> Row:
    rates = dict(points)
    cells = (format_percent(rates.get(radius)) for radius in radii)
    return Row((label, KIND_NAMES[kind], *cells, str(points[0][1].n)))


def radii_chart(success: SuccessByRadius) -> Chart:
    """Return the chart of the page: a row per kind and radius, with a dot per model."""
    labels = list(dict.fromkeys(line.label for line in success.lines))
    floor = dict(success.floor)
    rows = []
    for kind in dict.fromkeys(line.kind for line in success.lines):
        rates = {line.label: dict(line.points) for line in success.lines if line.kind == kind}
        radii = sorted(set().union(*rates.values()))
        for radius in radii:
            known = [rates.get(label, {}).get(radius) for label in labels]
            dots = [None if rate is None else dot_of(rate, rate.n) for rate in known]
            of_floor = floor.get(radius) if kind == ManipulationKind.PICKUP else None
            chance = None if of_floor is None else 100 * of_floor.mean
            heading = KIND_NAMES[kind] if radius == radii[0] else ""
            rows.append(DotRow(f"{radius:g} m", dots, chance, heading))
    return dots_chart(
        DotsChart(
            title="Success by the hand's radius",
            caption=(
                "A row is a radius of the hand's sphere, a dot a model with its 95 % interval; of "
                "pick-ups the dashed line is an arm that only closes its hand."
            ),
            axis="success (%)",
            label="kind and radius",
            series=[Series(label, place) for place, label in enumerate(labels)],
            rows=rows,
            dashed=_FLOOR,
        )
    )


def radii_figure(success: SuccessByRadius) -> Figure:
    """Return a figure with a panel per kind."""
    drawn = {line.kind for line in success.lines}
    kinds = [kind for kind in ManipulationKind if kind in drawn]
    labels = list(dict.fromkeys(line.label for line in success.lines if not line.is_bound))
    looks = looks_of(labels) | {line.label: BOUND for line in success.lines if line.is_bound}
    width = len(kinds) * _PANEL[0] + LEGEND
    height = max(_PANEL[1], _LINE * (len(looks) + 2)) + _MARGIN
    figure = Figure(figsize=(width, height), layout="constrained")
    panels = figure.subplots(1, len(kinds), sharex=True, sharey=True, squeeze=False)[0]
    for axes, kind in zip(panels, kinds, strict=True):
        if kind == ManipulationKind.PICKUP:
            _draw_floor(axes, success.floor)
        _draw_panel(axes, [line for line in success.lines if line.kind == kind], looks)
        axes.set_title(KIND_NAMES[kind])
        axes.set_xlabel("radius of the hand's sphere (m)")
    panels[0].set_ylabel("success (%)")
    panels[0].set_ylim(-3, 103)
    bounds = [(label, look) for label, look in looks.items() if look is BOUND]
    floor = [(_FLOOR, _FLOOR_LOOK)] if success.floor else []
    add_legend(panels[-1], [*bounds, *((label, looks[label]) for label in labels), *floor])
    add_words(figure, _heading(success), success.notes, width)
    return figure


def _draw_floor(axes: Axes, points: Sequence[tuple[float, Rate]]) -> None:
    """Draw the success of an arm that only closes its hand, below all lines."""
    radii = [radius for radius, _ in points]
    means = [100 * rate.mean for _, rate in points]
    axes.fill_between(radii, means, color=_FLOOR_LOOK.colour, alpha=0.15, linewidth=0, zorder=1)
    axes.plot(
        radii, means, color=_FLOOR_LOOK.colour, lw=_FLOOR_LOOK.width, zorder=2.5, marker="o", ms=5
    )


def _draw_panel(axes: Axes, lines: Sequence[RadiusLine], looks: Mapping[str, Look]) -> None:
    for order, line in enumerate(lines, 3):
        look = looks[line.label]
        radii = [radius for radius, _ in line.points]
        means = [100 * rate.mean for _, rate in line.points]
        low = [100 * (rate.mean if rate.low is None else rate.low) for _, rate in line.points]
        high = [100 * (rate.mean if rate.high is None else rate.high) for _, rate in line.points]
        axes.plot(
            radii,
            means,
            color=look.colour,
            ls=look.style,
            lw=look.width,
            marker="o",
            ms=3.5,
            zorder=order,
        )
        # Beside the points: intervals of several lines would hide each other.
        offset = [radius + _OFFSET * (order - 2 - len(lines) / 2) for radius in radii]
        axes.vlines(offset, low, high, color=look.colour, lw=1.2, alpha=0.55, zorder=2.8)


def _heading(success: SuccessByRadius) -> list[str]:
    intervals = ", 95 % intervals beside the points" if success.n_trajectories > 1 else ""
    title = (
        f"Success by radius on {success.task}: episodes of "
        f"{trajectories_text(success.n_trajectories)}{intervals}"
    )
    return [title, *_label(success)]


def _label(success: SuccessByRadius) -> tuple[str, ...]:
    """Return the note on numbers of the embedded simulator."""
    by_label = {line.label: line.is_embedded for line in success.lines}
    label = embedded_note(
        [name for name, is_embedded in by_label.items() if is_embedded], len(by_label), "results"
    )
    return () if label is None else (label,)
