"""`infthor-eval report`: a figure of the paper, of one's own runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from infthor_eval.agents.curve_runs import PlansRun

__all__ = ["command"]

_FIGURES = {"7": "reward of plans over steps and over context tokens"}
_SUITE = "plans"  # that figure 7 is of
_PATH = click.Path(path_type=Path)


@click.command("report")
@click.argument("runs", metavar="RUN...", nargs=-1, required=True, type=_PATH)
@click.option("--figure", required=True, metavar="N", help="Which figure: 7 (reward over steps and context tokens).")
@click.option("--out", type=_PATH, default=Path("results/figures"), show_default=True, help="Folder for the pictures.")
@click.option("--panels", type=_PATH, metavar="FILE.yaml", help="Which runs stand in which panel; else all in one.")
@click.option("--task", help="The task to draw, where the runs share several.")
def command(runs: tuple[Path, ...], figure: str, out: Path, panels: Path | None, task: str | None) -> None:
    """Draw a figure of the paper from the journals of the runs in the folders RUN..., as PNG and SVG.

    A run of the baseline `planner` among them is the upper bound. Only trajectories that all runs have are drawn.
    """
    from infthor_eval.agents.curves import reward_curves
    from infthor_eval.errors import UsageError
    from infthor_eval.formats.files import prepared_folder, require_writable
    from infthor_eval.report.curves import curves_table, one_panel, read_panels
    from infthor_eval.report.figures import draw_curves
    from infthor_eval.report.terminal import print_table, table_console
    from infthor_eval.terminal import tell

    if figure not in _FIGURES:
        there = ", ".join(f"{number} ({about})" for number, about in _FIGURES.items())
        raise UsageError(f"--figure {figure}: is none that can be drawn; there are {there}")
    require_writable(out)
    curves = reward_curves(_opened(runs, figure), task)
    wanted = one_panel(curves) if panels is None else read_panels(panels, curves)
    paths = draw_curves(curves, wanted, prepared_folder(out), f"figure{figure}")
    print_table(curves_table(curves), table_console())
    left = [run.label for run in curves.runs if not run.is_bound and all(run.label not in of.labels for of in wanted)]
    if left:
        tell(f"in no panel: {', '.join(left)}")
    for path in paths:
        tell(str(path))


def _opened(folders: tuple[Path, ...], figure: str) -> list[PlansRun]:
    from infthor_eval.agents.curve_runs import PlansRun
    from infthor_eval.agents.records import RECORDS
    from infthor_eval.errors import UsageError
    from infthor_eval.report.curves import run_labels
    from infthor_eval.runs import read_header, read_run

    headers = [read_header(folder) for folder in folders]
    for folder, header in zip(folders, headers, strict=True):
        if header.suite != _SUITE:
            raise UsageError(f"{folder}: is a run of {header.suite}, and figure {figure} is of {_SUITE}; leave it out")
    if len({folder.resolve() for folder in folders}) < len(folders):
        raise UsageError("one run is given twice; give each once")
    found = [read_run(folder, RECORDS) for folder in folders]
    labels = run_labels(folders, headers)
    return [PlansRun(label, *run) for label, run in zip(labels, found, strict=True)]
