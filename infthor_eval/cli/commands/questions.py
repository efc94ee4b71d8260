"""`infthor-eval questions`: make NIEH questions on a replayed set."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from infthor_eval.cli.options.values import FiniteFloat, WholeNumber
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options

__all__ = ["command"]

_PATH = click.Path(path_type=Path)


@click.command("questions")
@click.argument("folder", metavar="SET", type=_PATH)
@click.option("--out", required=True, type=_PATH, help="The CSV file to write.")
@click.option("--seed", type=WholeNumber(0), default=0, show_default=True, help="Makes every choice.")
@click.option("--per-trajectory", type=click.IntRange(1), default=25, show_default=True, help="Questions at most.")
@click.option(
    "--min-share",
    type=FiniteFloat(0, 1),
    default=0.001,
    show_default=True,
    help="Of a frame's pixels that an object must fill to count as shown.",
)
@click.option("--further", is_flag=True, help="Ask forms beside those of Table 3 too, under types of their own.")
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
    overwrite: bool,
    **workers: Any,
) -> None:
    """Make questions on a replayed set, in the words of the paper's Table 3.

    Exit status 1 where a trajectory of the set could not be read.
    """
    from infthor_eval.errors import wrap_errors
    from infthor_eval.formats.files import prepare_file, refuse_overwrite, write_atomically
    from infthor_eval.formats.qa_csv import encode_questions
    from infthor_eval.generation.questions.generate import generate_questions
    from infthor_eval.terminal import error_console, print_line

    prepare_file(out)
    notes = error_console()
    made = generate_questions(
        folder,
        seed=seed,
        per_trajectory=per_trajectory,
        share=min_share,
        further=further,
        worker_settings=parse_worker_settings(**workers),
        say=notes.print,
    )
    content = encode_questions(made.questions)
    if not overwrite:
        refuse_overwrite(out, content)
    with wrap_errors(f"{out}: cannot be written", "give another --out"), write_atomically(out) as partial:
        partial.write_bytes(content)
    told = f"{len(made.questions)} questions on {made.trajectories} trajectories: {out}\n{made.summary_text()}"
    print_line(told)
    for question in made.unconfirmed:
        notes.print(f"skipped, the checker disagrees: {question.traj_id}: {question.text}")
    for line in made.skipped:
        notes.print(f"skipped: {line}", style="red")
    context.exit(1 if made.skipped else 0)
