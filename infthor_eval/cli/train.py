"""`infthor-eval train`: fine-tune a model on trajectories and questions."""

from __future__ import annotations

from pathlib import Path

import click

from infthor_eval.cli.options import model_options_in

__all__ = ["command"]

_PATH = click.Path(path_type=Path)


@click.command("train")
@click.option("--recipe", "name", required=True, metavar="NAME|FILE", help="What to train on and how; see below.")
@click.option(
    "--data",
    "folders",
    multiple=True,
    required=True,
    type=_PATH,
    metavar="SET",
    help="A replayed set (`replay`), with a question file where there are to be questions; may be repeated.",
)
@click.option("--model", metavar="NAME", help="Another model than the recipe's.")
@click.option("--model-args", metavar="K=V,...", help="Its options (pretrained, dtype, ...), beside the recipe's.")
@click.option("--set", "changes", multiple=True, metavar="KEY=VALUE", help="Another setting of the recipe; repeatable.")
@click.option("--out", required=True, type=_PATH, help="Folder of the run; the checkpoint is in checkpoint/ there.")
@click.option("--dry-run", is_flag=True, help="Make the sequences, tell what they are, and train nothing.")
def command(
    name: str,
    folders: tuple[Path, ...],
    model: str | None,
    model_args: str | None,
    changes: tuple[str, ...],
    out: Path,
    dry_run: bool,
) -> int:
    """Fine-tune a model, and write a checkpoint that its family's adapter loads.

    Recipes of the package: infthor_32k, infthor_64k and infthor_130k (the paper's, Table 5), questions. Others are YAML
    files of the same form. Stopped, the same command goes on. Several processes: torchrun --nproc-per-node N
    --no-python infthor-eval train ...
    """
    from infthor_eval.cli.training import train
    from infthor_eval.training.recipe import read_recipe

    told = dict(_setting(item) for item in changes)
    told |= {} if model is None else {"model": model}
    told |= {f"model_args.{key}": value for key, value in model_options_in(model_args or "").items()}
    return train(read_recipe(name, told), folders, out, dry_run)


def _setting(item: str) -> tuple[str, str]:
    key, equals, value = item.partition("=")
    if not equals or not key.strip():
        raise click.UsageError(f"--set: {item!r} is not of the form key=value")
    return key.strip(), value.strip()
