"""`infthor-eval train`: fine-tune a model on trajectories and questions."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.cli.options.values import FiniteFloat, parse_model_args
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options
from infthor_eval.cli.progress.bar import PacedBar, StepBars
from infthor_eval.cli.progress.notes import NOTES, print_note
from infthor_eval.errors import DataError
from infthor_eval.terminal import console, progress_bar

if TYPE_CHECKING:
    from infthor_eval.training.fine_tuning import TrainingRun
    from infthor_eval.training.loop import Progress
    from infthor_eval.training.nano.settings import NanoRecipe, Scenes
    from infthor_eval.training.nano.stages import NanoProgress
    from infthor_eval.training.recipe import Recipe
    from infthor_eval.workers import WorkerSettings

__all__ = ["command", "make_data", "train", "train_nano"]

_PATH = click.Path(path_type=Path)
_GPUS, _TFLOPS = 8, 400.0
_PER_TRAJECTORY = 500  # questions at most: all that there are
_PARTS = {"see": "learning to see", "read": "learning to read", "tell": "learning to answer and to act"}


@dataclass(frozen=True)
class Machine:
    """What a run is reckoned for.

    Attributes:
        n_gpus: that share it.
        tflops: that one of them reaches.
    """

    n_gpus: int
    tflops: float


@click.command("train")
@click.option("--recipe", "name", required=True, metavar="NAME|FILE", help="What to train on and how; see below.")
@click.option(
    "--data",
    "folders",
    multiple=True,
    type=_PATH,
    metavar="SET",
    help="A replayed set (`replay`), with a question file where there are to be questions; may be repeated. "
    "The recipe tiny makes its own where none is given.",
)
@click.option("--model", metavar="NAME", help="Another model than the recipe's.")
@click.option("--model-args", metavar="K=V,...", help="Its options (pretrained, dtype, ...), beside the recipe's.")
@click.option("--set", "changes", multiple=True, metavar="KEY=VALUE", help="Another setting of the recipe; repeatable.")
@click.option("--out", required=True, type=_PATH, help="Folder of the run; the checkpoint is in checkpoint/ there.")
@click.option("--dry-run", is_flag=True, help="Tell what the sequences are and what the run would take; train nothing.")
@click.option("--gpus", type=click.IntRange(1), metavar="N", help=f"Of the machine, for --dry-run.  [default: {_GPUS}]")
@click.option(
    "--tflops",
    type=FiniteFloat(min=0, min_open=True),
    help=f"That one of them reaches, for --dry-run (an H100 has 989 in bfloat16).  [default: {_TFLOPS:g}]",
)
@worker_options
def command(
    name: str,
    folders: tuple[Path, ...],
    model: str | None,
    model_args: str | None,
    changes: tuple[str, ...],
    out: Path,
    dry_run: bool,
    gpus: int | None,
    tflops: float | None,
    **workers: Any,
) -> int:
    """Fine-tune a model, and write a checkpoint that its family's adapter loads.

    Recipes of the package: infthor_32k, infthor_64k and infthor_130k (the paper's, Table 5), questions, and tiny, which
    makes a small model from nothing. Others are YAML files of the same form.

    Stopped, the same command goes on (tiny keeps its data and learns anew). Workers share the making of its data.
    Several processes: torchrun --nproc-per-node N --no-python infthor-eval train ...
    """
    from infthor_eval.training.nano.settings import NanoRecipe
    from infthor_eval.training.recipe import read_recipe

    worker_settings = parse_worker_settings(**workers)
    told = dict(_setting(item) for item in changes)
    told |= {} if model is None else {"model": model}
    told |= {f"model_args.{key}": value for key, value in parse_model_args(model_args or "").items()}
    recipe = read_recipe(name, told)
    if not dry_run and (gpus is not None or tflops is not None):
        raise click.UsageError("--gpus and --tflops are what --dry-run reckons with; give it, or leave them out")
    if not worker_settings.is_local and (folders or not isinstance(recipe, NanoRecipe)):
        raise click.UsageError(
            "--workers and --ray-address share the making of data, which only the recipe tiny without --data does; "
            "leave them out, and train in several processes with torchrun"
        )
    if isinstance(recipe, NanoRecipe):
        if model is not None or model_args is not None or dry_run:
            raise click.UsageError("--model, --model-args and --dry-run are for recipes that begin with a model")
        return train_nano(recipe, folders, out, worker_settings)
    if not folders:
        raise click.UsageError("give --data, a replayed set to train on")
    return train(recipe, folders, out, Machine(gpus or _GPUS, tflops or _TFLOPS) if dry_run else None)


def _setting(item: str) -> tuple[str, str]:
    key, equals, value = item.partition("=")
    if not equals or not key.strip():
        raise click.UsageError(f"--set: {item!r} is not of the form key=value")
    return key.strip(), value.strip()


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
    from infthor_eval.training.fine_tuning import fine_tune, prepare_run

    run = prepare_run(recipe, folders)
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


def _tell(run: TrainingRun) -> None:
    """The sequences, and what none could be made of."""
    data = run.data
    longest = max(item.n_tokens for item in data.sequences)
    print_note(
        f"{run.recipe.title}: {len(data.sequences):,} sequences, {data.n_tokens:,} tokens (the longest {longest:,}), "
        f"loss on {data.n_trained:,}"
    )
    for reason, n in data.reasons().most_common(5):
        print_note(f"{n} left out: {reason}", "yellow")


def _tell_estimate(run: TrainingRun, machine: Machine) -> None:
    """Work, time and memory."""
    from infthor_eval.training.cost import estimate_cost
    from infthor_eval.training.network import SequenceModel, freeze

    network = SequenceModel(run.loaded)
    freeze(network, run.recipe.freeze)
    found = estimate_cost(run.recipe, network, run.data, machine.n_gpus)
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


def train_nano(recipe: NanoRecipe, folders: Sequence[Path], out: Path, worker_settings: WorkerSettings) -> int:
    """Train the small model.

    Args:
        recipe: how.
        folders: of replayed sets with questions; made in `out` where there are none.
        out: folder of the run.
        worker_settings: who makes the data.

    Returns:
        Exit code: 0.

    Raises:
        DataError: data cannot be made or read.
    """
    from infthor_eval.formats.files import prepare_folder
    from infthor_eval.training.export import export
    from infthor_eval.training.nano.stages import train_small_model

    prepare_folder(out)
    sets = list(folders) or [make_data(recipe.scenes, recipe.seed, out / "data", worker_settings)]
    with progress_bar(NOTES) as progress:
        bars = StepBars(progress)

        def watch(done: NanoProgress) -> None:
            bars.advance(_PARTS[done.part], done.step, done.n_steps, f"loss {done.loss:.3f}")

        loaded = train_small_model(recipe, sets, watch, print_note)
    export(loaded, out / "checkpoint")
    console().print(f"{out / 'checkpoint'}")
    return 0


def make_data(scenes: Scenes, seed: int, out: Path, worker_settings: WorkerSettings) -> Path:
    """Trajectories in procedural scenes, replayed, with every question that can be asked on them.

    What is there already is not made again.

    Args:
        scenes: which.
        seed: of the trajectories and the questions.
        out: folder of both.
        worker_settings: who makes them.

    Returns:
        The folder of the set.

    Raises:
        DataError: a trajectory cannot be made or replayed.
    """
    from infthor_eval.formats.files import prepare_folder
    from infthor_eval.formats.qa_csv import write_questions
    from infthor_eval.generation.generate_set import generate_with_workers
    from infthor_eval.generation.jobs import trajectory_jobs
    from infthor_eval.generation.questions.generate import generate_questions
    from infthor_eval.generation.replay_set import replay_with_workers, select
    from infthor_eval.thor.launch import embedded

    trajectories, made_set = prepare_folder(out / "trajectories"), prepare_folder(out / "set")
    jobs = trajectory_jobs(
        scenes.names, seed=seed, count=1, min_steps=scenes.min_steps, min_subgoals=1, final_task=False, max_fail=20
    )
    with progress_bar(NOTES) as progress:
        made = PacedBar(progress, "trajectories", len(jobs))
        generated = generate_with_workers(jobs, embedded(), trajectories, worker_settings, made.advance, print_note)
        selection, shown = select([trajectories]), PacedBar(progress, "frames", len(jobs))
        replayed = replay_with_workers(selection, embedded(), made_set, worker_settings, 1, shown.advance, print_note)
    failures = [str(item) for item in generated.failures]
    failures += [f"{item.place}: {item.message}" for item in replayed.failures]
    if failures:
        raise DataError(f"{out}: {failures[0]}; give other scenes")
    questions = generate_questions(
        made_set,
        seed=seed,
        per_trajectory=_PER_TRAJECTORY,
        further=True,
        worker_settings=worker_settings,
        say=print_note,
    )
    write_questions(made_set / "qa_set_data.csv", questions.questions)
    print_note(f"{len(jobs)} trajectories, {len(questions.questions):,} questions: {made_set}")
    return made_set
