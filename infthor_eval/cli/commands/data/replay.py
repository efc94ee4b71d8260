"""`infthor-eval replay`: replay recorded trajectories in a simulator, into frames and logs."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH, default_option, floor_plans_option
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options

if TYPE_CHECKING:
    from rich.console import Console

    from infthor_eval.generation.replay_set import ReplayForm
    from infthor_eval.generation.replay_summary import ReplaySummary

_MAX_SHOWN = 20  # failures and divergences printed one by one; all are in the JSON summary
# AI2-THOR 5.0.0's rendering qualities, best last.
QUALITIES = (
    "Very Low",
    "Low",
    "Medium",
    "MediumCloseFitShadows",
    "High",
    "High WebGL",
    "Very High",
    "Ultra",
)
_PUBLISHED_QUALITY = "MediumCloseFitShadows"
_SIZE = click.IntRange(1, 8192)  # pixels


@example_command("replay", "infthor-eval replay trajectories --out SET")
@click.argument("trajectories", nargs=-1, required=True, type=PATH)
@click.option("--out", required=True, type=PATH, help="Folder of the set, new or to be continued.")
@floor_plans_option
@click.option("--limit", type=click.IntRange(1), help="Trajectories, at most.")
@click.option(
    "--per-floor-plan", type=click.IntRange(1), help="Trajectories of one floor plan, at most."
)
@default_option("--frames", click.IntRange(1), 1, "Frames per move or turn.")
@click.option(
    "--unity", is_flag=True, help="Use AI2-THOR's own Unity build, not the embedded simulator."
)
@click.option(
    "--timeline",
    is_flag=True,
    help="Write what the published renderer writes for the authors' website, in a folder "
    "for each trajectory: frames/000000.jpg and so on, and timeline.json.",
)
@click.option(
    "--smooth",
    type=click.IntRange(1),
    help="With --timeline: pictures of a move or look; a turn has twice as many.  [default: 1]",
)
@click.option("--width", type=_SIZE, help="With --timeline: pixels of a picture.  [default: 640]")
@click.option("--height", type=_SIZE, help="With --timeline: pixels of a picture.  [default: 640]")
@click.option(
    "--quality",
    type=click.Choice(QUALITIES),
    metavar="NAME",
    help=f"With --timeline --unity: rendering quality: {', '.join(QUALITIES)}.  "
    f"[default: {_PUBLISHED_QUALITY}]",
)
@click.option(
    "--jpeg-quality",
    type=click.IntRange(1, 100),
    help="With --timeline: quality of the pictures' files.  [default: 88]",
)
@click.option(
    "--keep-going",
    is_flag=True,
    help="With --timeline: go on after a refused action, instead of ending there.",
)
@worker_options
@click.option("--json", "as_json", is_flag=True, help="Print the summary as one JSON object.")
def command(
    trajectories: tuple[Path, ...],
    out: Path,
    data: Path | None,
    limit: int | None,
    per_floor_plan: int | None,
    frames: int,
    unity: bool,
    as_json: bool,
    workers: int,
    ray_address: str | None,
    gpus_per_worker: float | None,
    **rendering: Any,
) -> int:
    """Replay trajectories (.json, .jsonl, .jsonl.gz, directories) into an NIEH set.

    Writes the first frame and one after each low-level action, the log of every frame, and the
    trajectory itself. Trajectories in the set are not replayed again. Refused actions are reported,
    and the replay continues. Exit code 1 if a trajectory cannot be replayed at all.
    """
    from infthor_eval.cli.progress.bar import JobBar, PacedBar
    from infthor_eval.generation.replay_set import replay_with_workers, select
    from infthor_eval.generation.replay_summary import summarise
    from infthor_eval.storage.files import hold_folder
    from infthor_eval.terminal import console, error_console, progress_bar
    from infthor_eval.thor import launch
    from infthor_eval.thor.supplement import supplement_file

    worker_settings = parse_worker_settings(workers, ray_address, gpus_per_worker)
    form = parse_form(frames=frames, unity=unity, **rendering)
    notes = error_console()
    with ExitStack() as held:
        held.enter_context(hold_folder(out))
        selection = select(trajectories, limit, per_floor_plan)
        supplement = held.enter_context(
            supplement_file(trajectory for _, trajectory in selection.items)
        )
        start = launch.unity_launch() if unity else launch.embedded_launch(data, supplement)
        with progress_bar(notes) as progress:
            bar = PacedBar(progress, "replay", len(selection.items))
            replayed = replay_with_workers(
                selection,
                start,
                out,
                worker_settings,
                form,
                bar.advance,
                notes.print,
                JobBar(progress).show,
            )
    if as_json:
        import msgspec

        click.echo(msgspec.json.encode(summarise(replayed)))
    else:
        _print(summarise(replayed), console())
    for failure in replayed.failures[:_MAX_SHOWN]:
        notes.print(f"not replayed: {failure.message}", style="red")
    return int(bool(replayed.failures))


def _print(summary: ReplaySummary, output: Console) -> None:
    from infthor_eval.generation.tables import overlaps_table, refusals_table, regular_numbers
    from infthor_eval.report.terminal import print_table

    output.print(
        f"{summary.trajectories} trajectories on {summary.floor_plans} floor plans "
        f"({summary.resumed} replayed earlier, {summary.failed} failed), {summary.complete} "
        f"complete, {summary.seconds} s"
    )
    for table in (refusals_table(summary), overlaps_table(summary)):
        if table is not None:
            print_table(table, output)
    output.print(regular_numbers(summary))
    for first in summary.diverged[:_MAX_SHOWN]:
        line = f"diverged: {first.traj_id}: step {first.step}: {first.action}: {first.error}"
        output.print(line)
    hidden = len(summary.diverged) - _MAX_SHOWN
    if hidden > 0:
        output.print(f"and {hidden} more; --json lists all")


def parse_form(
    *, timeline: bool, frames: int, unity: bool, keep_going: bool, **rendering: Any
) -> ReplayForm:
    """Return the form that the options give; without --timeline that of a set."""
    from infthor_eval.errors import UsageError
    from infthor_eval.generation.rendering import RenderSettings
    from infthor_eval.generation.replay import SetForm

    given = {name: value for name, value in rendering.items() if value is not None}
    if not timeline:
        names = [f"--{name.replace('_', '-')}" for name in (*given, *["keep_going"] * keep_going)]
        if names:
            raise UsageError(f"{names[0]}: is for --timeline; add it, or leave {names[0]} out")
        return SetForm(frames)
    if frames != 1:
        raise UsageError("--frames: is for sets; with --timeline give --smooth")
    if unity:
        given.setdefault("quality", _PUBLISHED_QUALITY)
    elif "quality" in given:
        raise UsageError("--quality: is Unity's; add --unity, or leave it out")
    return RenderSettings(**given, keep_going=keep_going)
