"""What `train` does: sequences, steps with a bar, and where the checkpoint is."""

import os
from collections.abc import Sequence
from pathlib import Path

from infthor_eval.cli.progress import NOTES, say
from infthor_eval.terminal import console, progress_bar
from infthor_eval.training.fine_tuning import Prepared, fine_tune, prepared
from infthor_eval.training.loop import Progress
from infthor_eval.training.recipe import Recipe

__all__ = ["train"]


def train(recipe: Recipe, folders: Sequence[Path], out: Path, dry_run: bool) -> int:
    """Train by a recipe, and say what came of it.

    Args:
        recipe: how.
        folders: of replayed sets.
        out: folder of the run.
        dry_run: makes the sequences alone.

    Returns:
        Exit code: 0.
    """
    run = prepared(recipe, folders)
    speaks = os.environ.get("RANK", "0") == "0"
    if speaks:
        _tell(run)
    if dry_run:
        return 0
    last: list[Progress] = []
    with progress_bar(NOTES) as progress:
        bar = progress.add_task("train", total=None, visible=speaks)

        def watch(done: Progress) -> None:
            last[:] = [done]
            said = f"train: loss {done.loss:.4f}, {done.tokens_per_second:,.0f} tokens/s"
            progress.update(bar, total=done.n_steps, completed=done.step, description=said)

        checkpoint = fine_tune(run, out, watch)
    if speaks:
        for done in last:
            console().print(f"step {done.step} of {done.n_steps}: loss {done.loss:.4f}")
        console().print(f"{checkpoint}")
    return 0


def _tell(run: Prepared) -> None:
    """The sequences, and what none could be made of."""
    data = run.data
    longest = max(item.n_tokens for item in data.sequences)
    say(
        f"{run.recipe.title}: {len(data.sequences):,} sequences, {data.n_tokens:,} tokens (the longest {longest:,}), "
        f"loss on {data.n_trained:,}"
    )
    for reason, n in data.reasons().most_common(5):
        say(f"{n} left out: {reason}", "yellow")
