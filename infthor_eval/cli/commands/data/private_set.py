"""`infthor-eval private-set`: a set of twins whose answers stay secret."""

from pathlib import Path
from typing import Any

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.values import PATH
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options

__all__ = ["command"]


@click.command(
    "private-set",
    cls=ExampleCommand,
    example="infthor-eval private-set --seed-file secret.txt --out held_out",
)
@click.option(
    "--seed-file",
    type=PATH,
    required=True,
    metavar="FILE",
    help="The secret: 32 hexadecimal digits or more (openssl rand -hex 32).",
)
@click.option("--out", type=PATH, required=True, metavar="DIR", help="Folder of both parts.")
@click.option(
    "--homes", type=click.IntRange(1), default=12, show_default=True, help="A trajectory in each."
)
@click.option("--kinds", metavar="KIND,...", help="Kinds of edits, with commas; default: all.")
@click.option(
    "--min-steps",
    type=click.IntRange(1),
    default=300,
    show_default=True,
    help="Steps of each trajectory, at least.",
)
@click.option(
    "--per-trajectory",
    type=click.IntRange(1),
    default=25,
    show_default=True,
    help="Paired questions of one trajectory, at most.",
)
@worker_options
def command(
    seed_file: Path,
    out: Path,
    homes: int,
    kinds: str | None,
    min_steps: int,
    per_trajectory: int,
    **workers: Any,
) -> int:
    """Make a set of twins from a secret, and the part of it that can be published.

    DIR/public has frames and questions without answers; DIR/key has all else and is needed to score
    (`rescore --key`, `submit-check --key`). The same secret makes the same files (docs/submit.md).
    Exit code 1 if no twins can be made of a home.
    """
    from functools import partial

    from infthor_eval.cli.commands.data.questions import parse_kinds
    from infthor_eval.cli.progress.bar import PacedBar
    from infthor_eval.cli.progress.notes import NOTES, print_failure, print_note
    from infthor_eval.generation.private.making import make_private_set
    from infthor_eval.generation.private.secrets import read_secret
    from infthor_eval.nieh.scoring import score
    from infthor_eval.storage.files import hold_folder
    from infthor_eval.terminal import print_line, progress_bar

    secret = read_secret(seed_file)
    worker_settings = parse_worker_settings(**workers)
    with hold_folder(out), progress_bar(NOTES) as progress:
        bars = {name: PacedBar(progress, name, homes) for name in ("trajectories", "twins")}
        made = make_private_set(
            secret,
            out,
            partial(score, scorer="strict"),
            kinds=parse_kinds(kinds),
            n_homes=homes,
            min_steps=min_steps,
            per_trajectory=per_trajectory,
            worker_settings=worker_settings,
            progress=lambda name, resumed: bars[name].advance(resumed),
            say=print_note,
        )
    print_line(f"{made.n_pairs} pairs of questions on {made.n_trajectories} trajectories")
    print_line(f"to publish: {made.public}")
    print_line(f"to keep secret: {made.key}, {seed_file}")
    for failure in made.failures:
        print_failure(f"left out: {failure}")
    return int(bool(made.failures))
