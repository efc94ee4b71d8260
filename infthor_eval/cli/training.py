"""What `train` does: sequences, steps with a bar, and where the checkpoint is."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.cli.paced_bar import StepBars
from infthor_eval.cli.progress import NOTES, say
from infthor_eval.terminal import console, progress_bar
from infthor_eval.training.estimate import estimate
from infthor_eval.training.fine_tuning import Prepared, fine_tune, prepared
from infthor_eval.training.loop import Progress
from infthor_eval.training.network import SequenceModel, freeze
from infthor_eval.training.recipe import Recipe

__all__ = ["train"]


@dataclass(frozen=True)
class Machine:
    """What a run is reckoned for.

    Attributes:
        n_gpus: that share it.
        tflops: that one of them reaches.
    """

    n_gpus: int
    tflops: float


def train(recipe: Recipe, folders: Sequence[Path], out: Path, only_for: Machine | None = None) -> int:
    """Train by a recipe, and say what came of it.

    Args:
        recipe: how.
        folders: of replayed sets.
        out: folder of the run.
        only_for: tells what the run would take there, and trains nothing.

    Returns:
        Exit code: 0.
    """
    run = prepared(recipe, folders)
    speaks = os.environ.get("RANK", "0") == "0"
    if speaks:
        _tell(run)
    if only_for is not None:
        _tell_estimate(run, only_for)
        return 0
    last: list[Progress] = []
    with progress_bar(NOTES) as progress:
        bars = StepBars(progress)

        def watch(done: Progress) -> None:
            last[:] = [done]
            said = f"loss {done.loss:.4f}, {done.tokens_per_second:,.0f} tokens/s"
            bars.advance("train", done.step, done.n_steps, said)

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


def _tell_estimate(run: Prepared, machine: Machine) -> None:
    """Work, time and memory."""
    network = SequenceModel(run.loaded)
    freeze(network, run.recipe.freeze)
    found = estimate(run.recipe, network, run.data, machine.n_gpus)
    hours = found.hours(machine.n_gpus * machine.tflops)
    console().print(
        f"work: {found.flop:.2e} FLOP, {hours:,.1f} hours of {machine.n_gpus} GPUs at {machine.tflops:g} TFLOP/s each"
    )
    parts = {
        "weights": found.weights,
        "gradients": found.gradients,
        "optimizer": found.optimizer,
        "activations": found.activations,
    }
    said = ", ".join(f"{name} {size / 1e9:,.1f}" for name, size in parts.items())
    console().print(f"memory of a process: {found.memory / 1e9:,.1f} GB ({said})")
