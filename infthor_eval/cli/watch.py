"""`infthor-eval watch`: what an agent did, as a film."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from infthor_eval.cli.options import FiniteRange

if TYPE_CHECKING:
    from rich.progress import TaskID

    from infthor_eval.agents.curve_runs import PlansRun
    from infthor_eval.agents.moments import Moment
    from infthor_eval.agents.replaying import Record, Recorded
    from infthor_eval.terminal import PlainConsole

__all__ = ["command"]

_SUITE = "plans"
_PATH = click.Path(path_type=Path)
_FOLDER = Path("results/recordings")


@click.command("watch")
@click.argument("run", type=_PATH)
@click.option("--trajectory", metavar="NAME", help="Which trajectory of the run, where it has several.")
@click.option("--task", metavar="NAME", help="Which task of the run, where it has several.")
@click.option("--plans", metavar="N or N-M", help="Only these plans of it, counted from 1; else all.")
@click.option("--out", type=_PATH, metavar="FILE", help=f"What to write, .mp4 or .gif.  [default: in {_FOLDER}]")
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
    out: Path | None,
    data: Path | None,
    scenes: Path | None,
    fps: float,
) -> None:
    """Show what an agent did in a run of plans: frame, map, plan, action and reward beside each other.

    RUN is the run's folder. A journal has every action and no frame: the actions are carried out again, in the
    simulator of the run. Where one ends otherwise than recorded, a line says so.
    """
    from infthor_eval.agents.replaying import recorded_plans, replay
    from infthor_eval.formats.files import prepared_file
    from infthor_eval.formats.moving_pictures import require_moving, write_moving
    from infthor_eval.report.recording import pictures
    from infthor_eval.terminal import error_console, progress_bar, tell

    if out is not None:
        require_moving(out)
    recorded = recorded_plans(_opened(run), task, trajectory)
    chosen = _chosen(recorded, plans)
    path = prepared_file(out or _place(recorded, plans))
    notes = error_console()
    with replay(recorded, str(data) if data is not None else None, scenes) as stage, progress_bar(notes) as progress:
        bar = progress.add_task(recorded.trajectory, total=sum(len(plan.payload.steps) + 1 for plan in chosen))
        moments = _followed(stage.moments(chosen), progress.advance, bar, notes)
        n_pictures = write_moving(path, pictures(moments, _heading(recorded)), fps)
    tell(f"{len(chosen)} of {stage.n_plans} plans, {n_pictures / fps:.0f} s: {path}")


def _opened(folder: Path) -> PlansRun:
    from infthor_eval.agents.curve_runs import PlansRun
    from infthor_eval.agents.records import RECORDS
    from infthor_eval.errors import UsageError
    from infthor_eval.runs import read_header, read_run

    header = read_header(folder)
    if header.suite != _SUITE:
        raise UsageError(f"{folder}: is a run of {header.suite}, and only runs of {_SUITE} can be watched")
    return PlansRun(header.name, *read_run(folder, RECORDS))


def _chosen(recorded: Recorded, plans: str | None) -> Sequence[Record]:
    from infthor_eval.errors import UsageError

    if plans is None:
        return recorded.plans
    found = re.fullmatch(r"(\d{1,9})(?:-(\d{1,9}))?", plans.strip())
    if found is None:
        raise UsageError(f"--plans {plans!r:.60}: is neither a plan's number nor two of them; write 7, or 3-7")
    return recorded.between(int(found[1]), int(found[2] or found[1]))


def _place(recorded: Recorded, plans: str | None) -> Path:
    """A file of its own for each choice."""
    parts = (recorded.run.label, recorded.task, recorded.trajectory, *([plans.strip()] if plans is not None else []))
    name = "-".join(re.sub(r"[^\w.-]", "_", part) for part in parts)
    return _FOLDER / f"{name:.200}.mp4"


def _heading(recorded: Recorded) -> str:
    about = recorded.run.about
    simulator = "embedded simulator" if about.is_embedded else about.simulator
    return f"{recorded.run.label}  ·  {recorded.task}  ·  {recorded.trajectory}  ·  {simulator}"


def _followed(
    moments: Iterable[Moment], advance: Callable[[TaskID], None], bar: TaskID, notes: PlainConsole
) -> Iterator[Moment]:
    """The same moments, with progress and with what there is to be told of them."""
    for moment in moments:
        if moment.note:
            notes.print(f"otherwise than recorded: {moment.note}")
        advance(bar)
        yield moment
