"""`infthor-eval validate`: keep the questions of a set that at least one of several models can answer."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import click

from infthor_eval.cli.options import ModelsAsked, Whole
from infthor_eval.cli.worker_options import worker_options
from infthor_eval.workers import WorkerSettings

__all__ = ["command"]


@click.command("validate")
@click.argument("set_folder", metavar="SET", type=click.Path(path_type=Path))
@click.option(
    "--models",
    type=ModelsAsked(),
    required=True,
    metavar="MODEL,...",
    help="Model names with commas; the paper uses four. MODEL:K=V,... gives one options of its own.",
)
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder of the validated set.")
@click.option("--decisions", type=click.Path(path_type=Path), help="The inspection list with keep or drop filled in.")
@click.option("--scorer", type=click.Choice(["strict", "reference"]), default="strict", show_default=True)
@click.option("--seed", type=Whole(), default=0, show_default=True, help="For whatever is random.")
@worker_options
def command(
    set_folder: Path,
    models: Mapping[str, Mapping[str, str]],
    out: Path,
    decisions: Path | None,
    scorer: Literal["strict", "reference"],
    seed: int,
    worker_settings: WorkerSettings,
) -> int:
    """Ask every question of SET of each model, on its clue frames alone, and keep what one of them answers.

    Rejected questions go to rejected.jsonl with every reply. Those with several clues that no model answers go to
    inspection.csv and inspection.html; decide, and pass the decisions back. Stopped, the same command goes on.
    """
    from infthor_eval.cli.requests import Asked, requests_for
    from infthor_eval.cli.validation import validate

    asked = Asked(tasks=("nieh_gt",), data=set_folder, output=out / "runs", seed=seed, worker_settings=worker_settings)
    requests = [request for model, options in models.items() for request in requests_for(asked, model, options)]
    return validate(requests, out, decisions, scorer)
