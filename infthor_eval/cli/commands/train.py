"""`infthor-eval train`: fine-tune a model on trajectories and questions."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH, FiniteFloat, parse_model_args, parse_pairs
from infthor_eval.cli.progress.bar import StepBars
from infthor_eval.cli.progress.notes import NOTES, print_note
from infthor_eval.formats.object_ids import Words
from infthor_eval.terminal import console, progress_bar

if TYPE_CHECKING:
    from infthor_eval.training.fine_tuning import TrainingRun
    from infthor_eval.training.loop import Progress
    from infthor_eval.training.recipe import Recipe

_GPUS = 8
_TFLOPS = 400.0


@example_command("train", "infthor-eval train --recipe questions --data SET --out runs/mine")
@click.option(
    "--recipe",
    "name",
    required=True,
    metavar="NAME|FILE",
    help="Recipe of the training; see above.",
)
@click.option(
    "--data",
    "folders",
    multiple=True,
    required=True,
    type=PATH,
    metavar="SET",
    help="Replayed set (`replay`) to train on, with a question file if the recipe needs questions; "
    "may be repeated.",
)
@click.option(
    "--model", metavar="NAME", help="Model to use instead of the recipe's, without its options."
)
@click.option(
    "--model-args",
    metavar="K=V,...",
    help="Options of the model (pretrained, dtype, ...), added to the recipe's.",
)
@click.option(
    "--set",
    "changes",
    multiple=True,
    metavar="KEY=VALUE",
    help="Change a setting of the recipe; may be repeated.",
)
@click.option(
    "--words",
    type=click.Choice(list(map(str, Words))),
    help="Words of plans and actions, as in evaluation.  [default: the recipe's]",
)
@click.option(
    "--out",
    required=True,
    type=PATH,
    help="Folder of the run; the checkpoint is written to checkpoint/ in it.",
)
@click.option(
    "--dry-run",
    is_flag=True,
    help="Print the size of the data and an estimate of time and memory; do not train.",
)
@click.option(
    "--gpus",
    type=click.IntRange(1),
    metavar="N",
    help=f"GPUs of the machine, for --dry-run.  [default: {_GPUS}]",
)
@click.option(
    "--tflops",
    type=FiniteFloat(min=0, min_open=True),
    help="TFLOP/s that a GPU reaches, for --dry-run (an H100 has 989 in bfloat16).  [default: "
    f"{_TFLOPS:g}]",
)
def command(
    name: str,
    folders: tuple[Path, ...],
    model: str | None,
    model_args: str | None,
    changes: tuple[str, ...],
    words: str | None,
    out: Path,
    dry_run: bool,
    gpus: int | None,
    tflops: float | None,
) -> None:
    """Fine-tune a model, and write a checkpoint that its family's adapter loads.

    Recipes of the package: infthor_32k, infthor_64k and infthor_130k (the paper's, Table 5),
    final_goals, final_text and final_frames (behind its final tasks), and questions. Others are
    YAML files of the same form.

    If it is stopped, the same command continues.
    Several processes: torchrun --nproc-per-node N --no-python infthor-eval train ...
    """
    from infthor_eval.training.recipe import read_recipe

    settings = parse_pairs(changes, "--set")
    settings |= {} if model is None else {"model": model}
    settings |= {} if words is None else {"words": words}
    model_options = parse_model_args(model_args or "")
    settings |= {f"model_args.{key}": value for key, value in model_options.items()}
    recipe = read_recipe(name, settings)
    if not dry_run and (gpus is not None or tflops is not None):
        raise click.UsageError("--gpus and --tflops are for --dry-run; add it, or leave them out")
    _fine_tune(recipe, folders, out, (gpus or _GPUS, tflops or _TFLOPS) if dry_run else None)


def _fine_tune(
    recipe: Recipe, folders: Sequence[Path], out: Path, machine: tuple[int, float] | None
) -> None:
    """Fine-tune a model; for a machine (GPUs, TFLOP/s of each), print an estimate instead."""
    from infthor_eval.training.fine_tuning import fine_tune, prepare_run

    is_first_process = os.environ.get("RANK", "0") == "0"  # set by torchrun
    if is_first_process:  # it takes minutes, and nobody knows how many sequences there will be
        print_note(f"{recipe.title}: building the sequences of {', '.join(map(str, folders))}")
    run = prepare_run(recipe, folders)
    if is_first_process:
        _print_data(run)
    if machine is not None:
        _print_estimate(run, *machine)
        return
    last: Progress | None = None
    with progress_bar(NOTES) as progress:
        bars = StepBars(progress)

        def observe(step: Progress) -> None:
            nonlocal last
            last = step
            detail = f"loss {step.loss:.4f}, {step.tokens_per_second:,.0f} tokens/s"
            bars.advance("train", step.step, step.n_steps, detail)

        checkpoint = fine_tune(run, out, observe)
    if is_first_process:
        if last is not None:  # a finished training that is run again has no step
            console().print(f"step {last.step} of {last.n_steps}: loss {last.loss:.4f}")
        console().print(f"{checkpoint}")


def _print_data(run: TrainingRun) -> None:
    data = run.data
    longest = max(sequence.n_tokens for sequence in data.sequences)
    print_note(
        f"{run.recipe.title}: {len(data.sequences):,} sequences, {data.n_tokens:,} tokens (the "
        f"longest {longest:,}), loss on {data.n_loss_tokens:,}"
    )
    for reason, n in data.skip_reasons().most_common(5):
        print_note(f"{n} skipped: {reason}", "yellow")


def _print_estimate(run: TrainingRun, n_gpus: int, tflops: float) -> None:
    from infthor_eval.training.cost import estimate_cost
    from infthor_eval.training.network import SequenceModel, freeze

    network = SequenceModel(run.loaded)
    freeze(network, run.recipe.freeze)
    cost = estimate_cost(run.recipe, network, run.data, n_gpus)
    console().print(
        f"work: {cost.flop:.2e} FLOP, {cost.hours(n_gpus * tflops):,.1f} hours of {n_gpus} GPUs at "
        f"{tflops:g} TFLOP/s each"
    )
    parts = ("weights", "gradients", "optimizer", "activations")
    sizes = ", ".join(f"{name} {getattr(cost, name) / 1e9:,.1f}" for name in parts)
    console().print(f"memory of a process: {cost.memory / 1e9:,.1f} GB ({sizes})")
