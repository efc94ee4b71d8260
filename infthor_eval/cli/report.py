"""`infthor-eval report`: a figure of the paper, of one's own runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

if TYPE_CHECKING:
    from infthor_eval.curves import RewardCurves
    from infthor_eval.runs import RunHeader
    from infthor_eval.tables import Table

__all__ = ["command"]

_PATH = click.Path(path_type=Path)


class _Asked(NamedTuple):
    """What is to be drawn."""

    folders: tuple[Path, ...]
    headers: Sequence[RunHeader]
    task: str | None
    panels: Path | None


class _Made(NamedTuple):
    """What there is to draw.

    Attributes:
        table: its numbers.
        draw: writes the pictures into a folder, under a name.
        left: what must be said beside, a line each.
    """

    table: Table
    draw: Callable[[Path, str], list[Path]]
    left: tuple[str, ...] = ()


@click.command("report")
@click.argument("runs", metavar="RUN...", nargs=-1, required=True, type=_PATH)
@click.option(
    "--figure",
    required=True,
    metavar="WHICH",
    help="6 (reward of arms along trajectories), 7 (reward of plans over steps and context tokens), "
    "radius (success of arms by the hand's radius).",
)
@click.option("--out", type=_PATH, default=Path("results/figures"), show_default=True, help="Folder for the pictures.")
@click.option("--panels", type=_PATH, metavar="FILE.yaml", help="Which runs stand in which panel; else all in one.")
@click.option("--task", help="The task to draw, where the runs share several; of arms, one of each kind: A,B.")
def command(runs: tuple[Path, ...], figure: str, out: Path, panels: Path | None, task: str | None) -> None:
    """Draw a figure of the paper from the journals of the runs in the folders RUN..., as PNG and SVG.

    A run of the baseline `planner`, or `planner-arm`, among them is the upper bound. Only trajectories that all runs
    have are drawn.
    """
    from infthor_eval.errors import UsageError
    from infthor_eval.formats.files import prepared_folder, require_writable
    from infthor_eval.report.terminal import print_table, table_console
    from infthor_eval.terminal import tell

    if figure not in _FIGURES:
        there = ", ".join(f"{name} ({found.about})" for name, found in _FIGURES.items())
        raise UsageError(f"--figure {figure}: is none that can be drawn; there are {there}")
    require_writable(out)
    drawn = _FIGURES[figure]
    if panels is not None and not drawn.has_panels:
        raise UsageError(f"--panels: figure {figure} has panels of its own; leave it out")
    made = drawn.make(_Asked(runs, _headers(runs, figure), task, panels))
    paths = made.draw(prepared_folder(out), f"figure{figure}" if figure.isdigit() else figure)
    print_table(made.table, table_console())
    for line in (*made.left, *map(str, paths)):
        tell(line)


def _headers(folders: tuple[Path, ...], figure: str) -> list[RunHeader]:
    from infthor_eval.errors import UsageError
    from infthor_eval.runs import read_header

    headers = [read_header(folder) for folder in folders]
    suite = _FIGURES[figure].suite
    for folder, header in zip(folders, headers, strict=True):
        if header.suite != suite:
            raise UsageError(f"{folder}: is a run of {header.suite}, and figure {figure} is of {suite}; leave it out")
    if len({folder.resolve() for folder in folders}) < len(folders):
        raise UsageError("one run is given twice; give each once")
    return headers


def _plans(asked: _Asked) -> _Made:
    from infthor_eval.agents.curve_runs import PlansRun
    from infthor_eval.agents.curves import reward_curves
    from infthor_eval.agents.records import RECORDS
    from infthor_eval.report.curves import model_names, run_labels
    from infthor_eval.runs import read_run

    found = [read_run(folder, RECORDS) for folder in asked.folders]
    labels = run_labels(asked.folders, model_names(asked.headers))
    runs = [PlansRun(label, *run) for label, run in zip(labels, found, strict=True)]
    return _curves(reward_curves(runs, asked.task), asked.panels)


def _arms(asked: _Asked) -> _Made:
    from infthor_eval.manipulation.curve_runs import arm_runs, with_radii
    from infthor_eval.manipulation.curves import arm_curves
    from infthor_eval.report.curves import model_names, run_labels

    named = with_radii(arm_runs(asked.folders, model_names(asked.headers)))
    labels = run_labels(asked.folders, [run.label for run in named])
    runs = [replace(run, label=label) for run, label in zip(named, labels, strict=True)]
    return _curves(arm_curves(runs, asked.task), asked.panels)


def _radii(asked: _Asked) -> _Made:
    from infthor_eval.manipulation.curve_runs import arm_runs
    from infthor_eval.manipulation.radii import success_by_radius
    from infthor_eval.report.curves import model_names
    from infthor_eval.report.radius_figure import draw_radii, radii_table

    found = success_by_radius(arm_runs(asked.folders, model_names(asked.headers)), asked.task)
    return _Made(radii_table(found), lambda folder, name: draw_radii(found, folder, name))


def _curves(curves: RewardCurves, panels: Path | None) -> _Made:
    from infthor_eval.report.curves import curves_table, one_panel, read_panels
    from infthor_eval.report.figures import draw_curves

    wanted = one_panel(curves) if panels is None else read_panels(panels, curves)
    left = [run.label for run in curves.runs if not run.is_bound and all(run.label not in of.labels for of in wanted)]
    told = (f"in no panel: {', '.join(left)}",) if left else ()
    return _Made(curves_table(curves), lambda folder, name: draw_curves(curves, wanted, folder, name), told)


class _Figure(NamedTuple):
    """A figure that can be drawn.

    Attributes:
        suite: whose runs it is of.
        about: what it shows.
        make: makes it of runs.
        has_panels: whether runs can be put into panels.
    """

    suite: str
    about: str
    make: Callable[[_Asked], _Made]
    has_panels: bool = True


_FIGURES = {
    "6": _Figure("manipulation", "reward of pick-ups and puts along trajectories", _arms),
    "7": _Figure("plans", "reward of plans over steps and over context tokens", _plans),
    "radius": _Figure("manipulation", "success of pick-ups and puts by the radius of the hand", _radii, False),
}
