"""Success over the radius of the hand's sphere, as a picture and as a table."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from infthor_eval.manipulation.kinds import KIND_NAMES, ManipulationKind
from infthor_eval.manipulation.radii import RadiusLine, SuccessByRadius
from infthor_eval.rates import Rate, format_percent
from infthor_eval.report.figures.curve_tables import embedded_note, trajectories_told
from infthor_eval.report.figures.style import BOUND, LEGEND, Look, add_legend, add_words, looks_of, save_figure
from infthor_eval.tables import Column, Row, Table

__all__ = ["draw_radii", "radii_figure", "radii_table"]

_FLOOR = "in the sphere at the start"
_FLOOR_LOOK = Look("#9a9a9a", "solid", 3.0)
_BESIDE = 0.004  # metres between the intervals of two lines
_PANEL, _MARGIN, _LINE = (4.4, 2.9), 1.1, 0.2  # inches


def draw_radii(found: SuccessByRadius, folder: Path, name: str) -> list[Path]:
    """Draw a panel per kind.

    Args:
        found: what is drawn.
        folder: takes the files.
        name: of the files, without what stands behind the dot.

    Returns:
        The files.

    Raises:
        DataError: a file cannot be written.
    """
    return save_figure(lambda: radii_figure(found), folder, name)


def radii_table(found: SuccessByRadius) -> Table:
    """A row per model and kind, a column per radius."""
    radii = sorted({radius for points in (found.floor, *(line.points for line in found.lines)) for radius, _ in points})
    rows = [_row(line.label, line.kind, line.points, radii, str(line.n_failed)) for line in found.lines]
    if found.floor:
        rows.append(_row(f"({_FLOOR})", ManipulationKind.PICKUP, found.floor, radii, "-"))
    names = (*(f"{radius:g} m" for radius in radii), "episodes", "failed")
    columns = (Column("model", False), Column("kind", False), *map(Column, names))
    told = trajectories_told(found.n_trajectories)
    return Table(f"{found.task}: success by radius, %, of {told}", columns, tuple(rows), (*_label(found), *found.notes))


def _row(
    label: str, kind: ManipulationKind, points: Sequence[tuple[float, Rate]], radii: Sequence[float], end: str
) -> Row:
    rates = dict(points)
    return Row(
        (label, KIND_NAMES[kind], *(format_percent(rates.get(radius)) for radius in radii), str(points[0][1].n), end)
    )


def radii_figure(found: SuccessByRadius) -> Figure:
    """The figure that `draw_radii` writes."""
    kinds = [kind for kind in ManipulationKind if any(line.kind == kind for line in found.lines)]
    labels = list(dict.fromkeys(line.label for line in found.lines if not line.is_bound))
    looks = looks_of(labels) | {line.label: BOUND for line in found.lines if line.is_bound}
    width = len(kinds) * _PANEL[0] + LEGEND
    height = max(_PANEL[1], _LINE * (len(looks) + 2)) + _MARGIN
    figure = Figure(figsize=(width, height), layout="constrained")
    panels = figure.subplots(1, len(kinds), sharex=True, sharey=True, squeeze=False)[0]
    for place, kind in zip(panels, kinds, strict=True):
        if kind == ManipulationKind.PICKUP:
            _draw_floor(place, found.floor)
        _draw_panel(place, [line for line in found.lines if line.kind == kind], looks)
        place.set_title(KIND_NAMES[kind])
        place.set_xlabel("radius of the hand's sphere (m)")
    panels[0].set_ylabel("success (%)")
    panels[0].set_ylim(-3, 103)
    bounds = [(label, look) for label, look in looks.items() if look is BOUND]
    floor = [(_FLOOR, _FLOOR_LOOK)] if found.floor else []
    add_legend(panels[-1], [*bounds, *((label, looks[label]) for label in labels), *floor])
    add_words(figure, _heading(found), found.notes, width)
    return figure


def _draw_floor(place: Axes, points: Sequence[tuple[float, Rate]]) -> None:
    """What is had without moving: beneath all lines."""
    radii, means = [radius for radius, _ in points], [100 * rate.mean for _, rate in points]
    place.fill_between(radii, means, color=_FLOOR_LOOK.colour, alpha=0.15, linewidth=0, zorder=1)
    place.plot(radii, means, color=_FLOOR_LOOK.colour, lw=_FLOOR_LOOK.width, zorder=2.5, marker="o", ms=5)


def _draw_panel(place: Axes, lines: Sequence[RadiusLine], looks: Mapping[str, Look]) -> None:
    for order, line in enumerate(lines, 3):
        look = looks[line.label]
        radii = [radius for radius, _ in line.points]
        means = [100 * rate.mean for _, rate in line.points]
        low = [100 * (rate.mean if rate.low is None else rate.low) for _, rate in line.points]
        high = [100 * (rate.mean if rate.high is None else rate.high) for _, rate in line.points]
        place.plot(radii, means, color=look.colour, ls=look.style, lw=look.width, marker="o", ms=3.5, zorder=order)
        # Beside the points, or those of several lines would hide each other.
        beside = [radius + _BESIDE * (order - 2 - len(lines) / 2) for radius in radii]
        place.vlines(beside, low, high, color=look.colour, lw=1.2, alpha=0.55, zorder=2.8)


def _heading(found: SuccessByRadius) -> list[str]:
    intervals = ", 95 % intervals beside the points" if found.n_trajectories > 1 else ""
    told = trajectories_told(found.n_trajectories)
    return [f"Success by radius on {found.task}: episodes of {told}{intervals}", *_label(found)]


def _label(found: SuccessByRadius) -> tuple[str, ...]:
    """What must stand where numbers of the embedded simulator are."""
    embedded = {line.label: line.is_embedded for line in found.lines}
    label = embedded_note([name for name, it in embedded.items() if it], len(embedded), "results")
    return () if label is None else (label,)
