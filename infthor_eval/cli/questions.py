"""`infthor-eval questions`: make NIEH questions on a replayed set."""

from __future__ import annotations

from pathlib import Path

import click

__all__ = ["command"]

_PATH = click.Path(path_type=Path)


@click.command("questions")
@click.argument("folder", metavar="SET", type=_PATH)
@click.option("--out", required=True, type=_PATH, help="The CSV file to write.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Makes every choice.")
@click.option("--per-trajectory", type=click.IntRange(1), default=25, show_default=True, help="Questions at most.")
@click.option(
    "--min-share",
    type=click.FloatRange(0, 1),
    default=0.001,
    show_default=True,
    help="Of a frame's pixels that an object must fill to count as shown.",
)
@click.option("--further", is_flag=True, help="Ask forms beside those of Table 3 too, under types of their own.")
@click.pass_context
def command(
    context: click.Context, folder: Path, out: Path, seed: int, per_trajectory: int, min_share: float, further: bool
) -> None:
    """Make questions on a replayed set, in the words of the paper's Table 3.

    Exit status 1 where a trajectory of the set could not be read.
    """
    from rich.console import Console

    from infthor_eval.formats.qa_csv import write_questions
    from infthor_eval.generation.questions.make import make_questions

    made = make_questions(folder, seed=seed, per_trajectory=per_trajectory, share=min_share, further=further)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_questions(out, made.questions)
    output = Console(soft_wrap=True)
    told = f"{len(made.questions)} questions on {made.trajectories} trajectories: {out}\n{made.words()}"
    output.print(told, highlight=False, markup=False)
    notes = Console(stderr=True, soft_wrap=True)
    for question in made.doubted:
        notes.print(
            f"skipped, the checker disagrees: {question.traj_id}: {question.text}", highlight=False, markup=False
        )
    for line in made.skipped:
        notes.print(f"skipped: {line}", style="red", highlight=False, markup=False)
    context.exit(1 if made.skipped else 0)
