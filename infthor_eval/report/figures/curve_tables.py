"""Curves of reward in words: the table of their ends, the panels, and notes."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.episodes.curves import RewardCurves, RunCurves
from infthor_eval.errors import DataError
from infthor_eval.formats.yaml_files import read_yaml
from infthor_eval.runs.completeness import unmarked
from infthor_eval.tables import Column, Row, Table, interval_cell

_MOST_PANELS = 12  # a figure with more cannot be read
_COLUMNS = ("reward", "95 % interval", "of the bound, %")


@dataclass(frozen=True)
class Panel:
    """A panel of a figure.

    Attributes:
        title: heading of the panel; empty for none.
        labels: labels of its runs; the bound is in every panel.
    """

    title: str
    labels: tuple[str, ...]


def one_panel(curves: RewardCurves) -> list[Panel]:
    """Return one panel with all runs."""
    return [Panel("", tuple(run.label for run in curves.runs))]


def read_panels(path: Path, curves: RewardCurves) -> list[Panel]:
    """Read panels from a YAML file: titles, each with a list of runs by their names in the table.

    Raises:
        DataError: it cannot be read, is of another form, or names a run that is not there.
    """
    fix = "write titles, each with a list of runs (docs/figures.md)"
    panels = read_yaml(path, fix)
    if not isinstance(panels, dict) or not panels:
        raise DataError(f"{path}: not a mapping; {fix}")
    if len(panels) > _MOST_PANELS:
        raise DataError(
            f"{path}: {len(panels)} panels, and a figure takes {_MOST_PANELS}; write several files"
        )
    return [_panel(path, str(title), named, curves) for title, named in panels.items()]


def _panel(path: Path, title: str, named: object, curves: RewardCurves) -> Panel:
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
    return Panel(title, tuple(labels[name] for name in dict.fromkeys(names)))


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
