"""`infthor-eval import-checkpoint`: a checkpoint of the published trainer as one that adapters load."""

from pathlib import Path

import click

from infthor_eval.cli.options.values import parse_model_args

__all__ = ["command"]

_PATH = click.Path(path_type=Path)


@click.command("import-checkpoint")
@click.argument("folder", type=_PATH)
@click.option("--model", default="llava-onevision", show_default=True, help="The model that the training began with.")
@click.option("--model-args", default="", metavar="K=V,...", help="Its options (pretrained, dtype, ...).")
@click.option("--out", required=True, type=_PATH, help="Folder of the checkpoint that is written.")
def command(folder: Path, model: str, model_args: str, out: Path) -> int:
    """Write a distributed checkpoint FOLDER of the published trainer as safetensors, with tokenizer and processor.

    Weights that it has not (those that were frozen) are those of the model that the training began with.
    """
    from infthor_eval.formats.files import prepare_folder
    from infthor_eval.terminal import print_line
    from infthor_eval.training.export import export
    from infthor_eval.training.published import import_weights
    from infthor_eval.training.starting_model import load_starting_model

    prepare_folder(out)
    loaded = load_starting_model(model, parse_model_args(model_args), "plain", seed=0)
    found = import_weights(loaded, folder)
    export(loaded, out)
    print_line(
        f"{found.n_taken} weights taken over, {found.n_kept} kept, {found.n_ignored} other tensors ignored: {out}"
    )
    return 0
