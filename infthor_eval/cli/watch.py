"""`infthor-eval watch`: what an agent or an arm did, as a film."""

from __future__ import annotations

from pathlib import Path

import click

from infthor_eval.cli.options import FiniteRange
from infthor_eval.cli.watching import FOLDER, Wanted

__all__ = ["command"]

_PATH = click.Path(path_type=Path)


@click.command("watch")
@click.argument("run", type=_PATH)
@click.option("--trajectory", metavar="NAME", help="Which trajectory of the run, where it has several.")
@click.option("--task", metavar="NAME", help="Which task of the run, where it has several.")
@click.option("--plans", metavar="N or N-M", help="Only these plans of it, counted from 1; else all.")
@click.option("--episode", metavar="N,...", help="Of arms: only those for these actions of the expert's; else all.")
@click.option("--sheet", type=_PATH, metavar="FILE.png", help="Of arms: frames of a few episodes on one page instead.")
@click.option("--out", type=_PATH, metavar="FILE", help=f"What to write, .mp4 or .gif.  [default: in {FOLDER}]")
@click.option("--data", type=_PATH, help="File or folder of the trajectories, where they do not come with the package.")
@click.option("--scenes", type=_PATH, help="Folder with recorded floor plans (thor_scenes/), as for the run.")
@click.option(
    "--fps", type=FiniteRange(0, 30, min_open=True), default=2.0, show_default=True, help="Actions shown in a second."
)
def command(
    run: Path,
    trajectory: str | None,
    task: str | None,
    plans: str | None,
    episode: str | None,
    sheet: Path | None,
    out: Path | None,
    data: Path | None,
    scenes: Path | None,
    fps: float,
) -> None:
    """Show what was done in a run of plans or of manipulation, beside what was seen.

    RUN is the run's folder. A journal has every action and no frame: the actions are carried out again, in the
    simulator of the run. Where one ends otherwise than recorded, a line says so.
    """
    from infthor_eval.cli.watch_arms import watch_arms
    from infthor_eval.cli.watch_plans import watch_plans
    from infthor_eval.errors import UsageError
    from infthor_eval.formats.animations import require_animation_name
    from infthor_eval.runs import read_header

    if out is not None:
        require_animation_name(out)
    if sheet is not None and sheet.suffix.lower() != ".png":
        raise UsageError(f"--sheet {sheet}: a sheet is a PNG; give a file whose name ends in .png")
    wanted = Wanted(
        run, trajectory, task, plans, episode, sheet, out, str(data) if data is not None else None, scenes, fps
    )
    suites = {"plans": watch_plans, "manipulation": watch_arms}
    suite = read_header(run).suite
    if suite not in suites:
        raise UsageError(f"{run}: is a run of {suite}, and only runs of {' and '.join(suites)} can be watched")
    suites[suite](wanted)
