"""`infthor-eval questions`: generate NIEH questions on a replayed set."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.values import PATH, FiniteFloat, WholeNumber
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options

__all__ = ["command"]


@click.command(
    "questions", cls=ExampleCommand, example="infthor-eval questions SET --out SET/qa_set_mine.csv"
)
@click.argument("folder", metavar="SET", type=PATH)
@click.option("--out", required=True, type=PATH, help="CSV file to write.")
@click.option(
    "--seed", type=WholeNumber(0), default=0, show_default=True, help="Seed of every choice."
)
@click.option(
    "--per-trajectory",
    type=click.IntRange(1),
    default=25,
    show_default=True,
    help="Questions per trajectory, at most.",
)
@click.option(
    "--min-share",
    type=FiniteFloat(0, 1),
    default=0.001,
    show_default=True,
    help="Share of a frame's pixels that an object must fill to count as visible.",
)
@click.option(
    "--further",
    is_flag=True,
    help="Add question forms that are not in Table 3, with their own types.",
)
@click.option(
    "--words",
    type=click.Choice(["plain", "published"]),
    default="plain",
    show_default=True,
    help="Plain English, or the published files' words with type names, to extend the published "
    "set.",
)
@click.option("--overwrite", is_flag=True, help="Replace a file that holds other questions.")
@worker_options
@click.pass_context
def command(
    context: click.Context,
    folder: Path,
    out: Path,
    seed: int,
    per_trajectory: int,
    min_share: float,
    further: bool,
    words: str,
    overwrite: bool,
    **workers: Any,
) -> None:
    """Generate questions on a replayed SET, in the words of the paper's Table 3.

    Exit code 1 if a trajectory of the set cannot be read.
    """
    from infthor_eval.errors import wrap_errors
    from infthor_eval.formats.qa_csv import encode_questions
    from infthor_eval.generation.questions.generate import generate_questions
    from infthor_eval.storage.files import prepare_file, refuse_overwrite, write_atomically
    from infthor_eval.terminal import error_console, print_line

    worker_settings = parse_worker_settings(**workers)
    prepare_file(out)
    notes = error_console()
    result = generate_questions(
        folder,
        seed=seed,
        per_trajectory=per_trajectory,
        share=min_share,
        further=further,
        published_words=words == "published",
        worker_settings=worker_settings,
        say=notes.print,
    )
    content = encode_questions(result.questions)
    if not overwrite:
        refuse_overwrite(out, content)
    with (
        wrap_errors(f"{out}: cannot be written", "give another --out"),
        write_atomically(out) as partial,
    ):
        partial.write_bytes(content)
    print_line(f"{len(result.questions)} questions on {result.trajectories} trajectories: {out}")
    print_line(result.summary_text())
    for question in result.unconfirmed:
        notes.print(f"skipped, the checker disagrees: {question.traj_id}: {question.text}")
    for line in result.skipped:
        notes.print(f"skipped: {line}", style="red")
    context.exit(1 if result.skipped else 0)
