"""`infthor-eval look-around`: level the camera in the long walks of trajectories that exist."""

from contextlib import ExitStack
from pathlib import Path

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH, default_option


@example_command("look-around", "infthor-eval look-around trajectories --out trajectories_level")
@click.argument("trajectories", type=PATH)
@click.option("--out", type=PATH, required=True, help="File, or folder for the files of a folder.")
@default_option(
    "--min-run",
    click.IntRange(1),
    default=6,
    help="Moves and turns in a row for which the camera is raised, at least.",
)
def command(trajectories: Path, out: Path, min_run: int) -> int:
    """Write TRAJECTORIES (a .json file, or a folder of them) with a level camera in walks.

    LookUp and LookDown actions are inserted as by the published script: around long walks with an
    empty hand, so that frames show the room. The object log and the names of frames stay those of
    the actions before; a replay makes new ones.
    """
    from infthor_eval.generation.look_around_set import look_around_files
    from infthor_eval.storage.files import hold_folder, prepare_file
    from infthor_eval.terminal import print_line

    with ExitStack() as held:
        if trajectories.is_dir():
            held.enter_context(hold_folder(out, "--out"))
        else:
            prepare_file(out, "--out")
        summary = look_around_files(trajectories, out, min_run)
    print_line(
        f"{summary.trajectories} trajectories ({summary.changed} changed), {summary.inserted} "
        f"camera actions inserted, {summary.steps} steps: {out}"
    )
    return 0
