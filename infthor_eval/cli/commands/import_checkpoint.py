"""`infthor-eval import-checkpoint`: convert a checkpoint of the published trainer."""

from pathlib import Path

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH, default_option, parse_model_args


@example_command(
    "import-checkpoint", "infthor-eval import-checkpoint global_step_1000 --out checkpoint"
)
@click.argument("checkpoint")
@click.option(
    "--model",
    default="llava-onevision",
    show_default=True,
    help="Model that the training started from.",
)
@click.option(
    "--model-args", default="", metavar="K=V,...", help="Its options (pretrained, dtype, ...)."
)
@default_option(
    "--prompt",
    click.Choice(("plain", "chat")),
    default="plain",
    help="Its prompts: the bare sequence, or for the Qwen2.5-VL of branch dev the base model's "
    "chat template.",
)
@click.option("--revision", help="Branch, tag or commit on the hub.  [default: its main branch]")
@click.option("--out", required=True, type=PATH, help="Folder of the new checkpoint.")
def command(
    checkpoint: str, model: str, model_args: str, prompt: str, revision: str | None, out: Path
) -> int:
    """Convert CHECKPOINT, a distributed one of the published trainer, into one that models load.

    CHECKPOINT is its folder, a folder of step-N of which the last is taken, or a folder of a hub's
    repository (PEARLS-Lab/infini-thor/checkpoints/NAME). The new checkpoint has safetensors,
    tokenizer and processor. Weights that CHECKPOINT lacks, because they were frozen, come from the
    model that the training started from.
    """
    from infthor_eval.formats.object_ids import Words
    from infthor_eval.storage.files import hold_folder
    from infthor_eval.terminal import print_line
    from infthor_eval.training.export import export
    from infthor_eval.training.published import find_weights, import_weights
    from infthor_eval.training.starting_model import load_starting_model

    with hold_folder(out):
        folder = find_weights(checkpoint, revision)
        loaded = load_starting_model(model, parse_model_args(model_args), prompt, seed=0)
        weights = import_weights(loaded, folder)
        export(loaded, out, title=f"{model}, weights of {folder.name}", words=Words.PUBLISHED)
    counts = (
        f"{weights.n_imported} weights imported, {weights.n_kept} kept, {weights.n_ignored} other "
        "tensors ignored"
    )
    print_line(f"{counts}: {out}")
    return 0
