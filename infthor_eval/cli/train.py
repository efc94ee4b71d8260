"""`infthor-eval train`: fine-tune a model on trajectories and questions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from infthor_eval.cli.options import FiniteRange, model_options_in
from infthor_eval.cli.worker_options import worker_options

if TYPE_CHECKING:
    from infthor_eval.workers import WorkerSettings

__all__ = ["command"]

_PATH = click.Path(path_type=Path)
_GPUS, _TFLOPS = 8, 400.0


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
    type=FiniteRange(min=0, min_open=True),
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
    worker_settings: WorkerSettings,
) -> int:
    """Fine-tune a model, and write a checkpoint that its family's adapter loads.

    Recipes of the package: infthor_32k, infthor_64k and infthor_130k (the paper's, Table 5), questions, and tiny, which
    makes a small model from nothing. Others are YAML files of the same form.

    Stopped, the same command goes on (tiny keeps its data and learns anew). Workers share the making of its data.
    Several processes: torchrun --nproc-per-node N --no-python infthor-eval train ...
    """
    from infthor_eval.training.nano.settings import NanoRecipe
    from infthor_eval.training.recipe import read_recipe

    told = dict(_setting(item) for item in changes)
    told |= {} if model is None else {"model": model}
    told |= {f"model_args.{key}": value for key, value in model_options_in(model_args or "").items()}
    recipe = read_recipe(name, told)
    if not dry_run and (gpus is not None or tflops is not None):
        raise click.UsageError("--gpus and --tflops are what --dry-run reckons with; give it, or leave them out")
    if not worker_settings.is_local and (folders or not isinstance(recipe, NanoRecipe)):
        raise click.UsageError(
            "--workers and --ray-address share the making of data, which only the recipe tiny without --data does; "
            "leave them out, and train in several processes with torchrun"
        )
    if isinstance(recipe, NanoRecipe):
        from infthor_eval.cli.nano_training import train_nano

        if model is not None or model_args is not None or dry_run:
            raise click.UsageError("--model, --model-args and --dry-run are for recipes that begin with a model")
        return train_nano(recipe, folders, out, worker_settings)
    from infthor_eval.cli.training import Machine, train

    if not folders:
        raise click.UsageError("give --data, a replayed set to train on")
    return train(recipe, folders, out, Machine(gpus or _GPUS, tflops or _TFLOPS) if dry_run else None)


def _setting(item: str) -> tuple[str, str]:
    key, equals, value = item.partition("=")
    if not equals or not key.strip():
        raise click.UsageError(f"--set: {item!r} is not of the form key=value")
    return key.strip(), value.strip()
