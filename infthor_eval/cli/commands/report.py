"""`infthor-eval report`: one's own runs as a page, or as a figure of the paper."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from infthor_eval.cli.options.values import WholeNumber

if TYPE_CHECKING:
    from infthor_eval.episodes.curves import RewardCurves
    from infthor_eval.report.web.episode_samples import Opener, Stage
    from infthor_eval.report.web.runs import ReportRun
    from infthor_eval.runs import RunHeader
    from infthor_eval.tables import Table

__all__ = ["command", "stages"]

_PATH = click.Path(path_type=Path)
_PAGE, _FOLDER = Path("results/report.html"), Path("results/figures")


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
    "--out",
    type=_PATH,
    help=f"The page, an .html file, or the folder for a figure's pictures.  [default: {_PAGE}, {_FOLDER}]",
)
@click.option("--data", type=_PATH, help="The questions' set, or the trajectories, where runs do not tell.")
@click.option("--scenes", type=_PATH, help="Folder with recorded floor plans (thor_scenes/), as for the run.")
@click.option(
    "--episodes",
    type=WholeNumber(0),
    default=12,
    show_default=True,
    metavar="N",
    help="Plans and arm's errands of each run that are carried out again, to show what was seen.",
)
@click.option(
    "--figure",
    metavar="WHICH",
    help="Draw a figure instead: 6 (reward of arms along trajectories), 7 (reward of plans over steps and context "
    "tokens), radius (success of arms by the hand's radius).",
)
@click.option("--panels", type=_PATH, metavar="FILE.yaml", help="Which runs stand in which panel; else all in one.")
@click.option("--task", help="The task to draw, where the runs share several; of arms, one of each kind: A,B.")
def command(
    runs: tuple[Path, ...],
    out: Path | None,
    data: Path | None,
    scenes: Path | None,
    episodes: int,
    figure: str | None,
    panels: Path | None,
    task: str | None,
) -> None:
    """Write what the runs in the folders RUN... found as one page that works from a file: numbers, pictures, samples.

    With --figure, draw a figure of the paper instead, as PNG and SVG. A run of the baseline `planner`, or
    `planner-arm`, among them is the upper bound. Only trajectories that all runs have are drawn.
    """
    if figure is not None:
        _draw(_Asked(runs, _headers(runs, figure), task, panels), figure, out or _FOLDER)
        return
    _refuse({"--panels": panels, "--task": task})
    _write(runs, out or _PAGE, data, scenes, episodes)


def _refuse(given: dict[str, object]) -> None:
    from infthor_eval.errors import UsageError

    for option, value in given.items():
        if value is not None:
            raise UsageError(f"{option}: is for a figure; give --figure too, or leave it out")


def _write(runs: tuple[Path, ...], out: Path, data: Path | None, scenes: Path | None, episodes: int) -> None:
    from infthor_eval.errors import UsageError
    from infthor_eval.formats.files import prepare_file
    from infthor_eval.report.web.build import Wanted, build_page
    from infthor_eval.report.web.page import write_page
    from infthor_eval.report.web.runs import read_report_runs
    from infthor_eval.suites import suite_named
    from infthor_eval.terminal import error_console, print_line

    if out.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"--out {out}: the page is an .html file; name one")
    path = prepare_file(out)
    found = read_report_runs(runs, suite_named)
    with error_console().status("making the page"):
        page = build_page(found, Wanted(data, _stages(found, scenes, episodes), episodes))
    size = write_page(page, path)
    print_line(f"{len(page.samples):,} samples, {len(page.pictures):,} pictures, {size / 1e6:.1f} MB: {path}")


def _stages(runs: Sequence[ReportRun], scenes: Path | None, episodes: int) -> Mapping[str, Opener]:
    """None where nothing is carried out again: they bring the simulator's client with them."""
    if not episodes or all(run.suite.name == "nieh" for run in runs):
        return {}
    return stages(scenes)


def stages(scenes: Path | None) -> Mapping[str, Opener]:
    """The stages, by suite.

    Args:
        scenes: folder with recorded floor plans, for the embedded simulator.
    """
    from infthor_eval.manipulation.replaying import recorded_episodes, replay_episodes
    from infthor_eval.plans.replaying import recorded_plans, replay
    from infthor_eval.report.web.arm_samples import arm_run
    from infthor_eval.report.web.plan_samples import plans_run

    @contextmanager
    def plans(run: ReportRun, task: str, trajectory: str, data: Path | None) -> Iterator[Stage]:
        with replay(recorded_plans(plans_run(run), task, trajectory), _text(data), scenes) as stage:
            yield stage

    @contextmanager
    def errands(run: ReportRun, task: str, trajectory: str, data: Path | None) -> Iterator[Stage]:
        with replay_episodes(recorded_episodes(arm_run(run), task, trajectory), _text(data), scenes) as stage:
            yield stage

    return {"plans": plans, "manipulation": errands}


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)


def _draw(asked: _Asked, figure: str, out: Path) -> None:
    from infthor_eval.errors import UsageError
    from infthor_eval.formats.files import prepare_folder, require_writable
    from infthor_eval.report.terminal import print_table, table_console
    from infthor_eval.terminal import print_line

    require_writable(out)
    drawn = _FIGURES[figure]
    if asked.panels is not None and not drawn.has_panels:
        raise UsageError(f"--panels: figure {figure} has panels of its own; leave it out")
    made = drawn.make(asked)
    paths = made.draw(prepare_folder(out), f"figure{figure}" if figure.isdigit() else figure)
    print_table(made.table, table_console())
    for line in (*made.left, *map(str, paths)):
        print_line(line)


def _headers(folders: tuple[Path, ...], figure: str) -> list[RunHeader]:
    from infthor_eval.errors import UsageError
    from infthor_eval.runs import read_header

    if figure not in _FIGURES:
        there = ", ".join(f"{name} ({found.about})" for name, found in _FIGURES.items())
        raise UsageError(f"--figure {figure}: is none that can be drawn; there are {there}")
    headers = [read_header(folder) for folder in folders]
    suite = _FIGURES[figure].suite
    for folder, header in zip(folders, headers, strict=True):
        if header.suite != suite:
            raise UsageError(f"{folder}: is a run of {header.suite}, and figure {figure} is of {suite}; leave it out")
    if len({folder.resolve() for folder in folders}) < len(folders):
        raise UsageError("one run is given twice; give each once")
    return headers


def _plans(asked: _Asked) -> _Made:
    from infthor_eval.plans.curves import plan_curves
    from infthor_eval.plans.recorded_runs import PlansRun
    from infthor_eval.report.curves import model_names, run_labels

    labels = run_labels(asked.folders, model_names(asked.headers))
    runs = [PlansRun.read(folder, label) for folder, label in zip(asked.folders, labels, strict=True)]
    return _curves(plan_curves(runs, asked.task), asked.panels)


def _arms(asked: _Asked) -> _Made:
    from infthor_eval.manipulation.curves import arm_curves
    from infthor_eval.manipulation.recorded_runs import ArmRun, label_by_radius
    from infthor_eval.report.curves import model_names, run_labels

    named = label_by_radius(list(map(ArmRun.read, asked.folders, model_names(asked.headers))))
    labels = run_labels(asked.folders, [run.label for run in named])
    runs = [replace(run, label=label) for run, label in zip(named, labels, strict=True)]
    return _curves(arm_curves(runs, asked.task), asked.panels)


def _radii(asked: _Asked) -> _Made:
    from infthor_eval.manipulation.radii import success_by_radius
    from infthor_eval.manipulation.recorded_runs import ArmRun
    from infthor_eval.report.curves import model_names
    from infthor_eval.report.radius_figure import draw_radii, radii_table

    found = success_by_radius(list(map(ArmRun.read, asked.folders, model_names(asked.headers))), asked.task)
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
