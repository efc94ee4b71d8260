"""`python -m recipes.nano`: train the small model from scratch."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.main import run_program
from infthor_eval.cli.options.values import PATH, parse_pairs
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options
from infthor_eval.cli.progress.bar import StepBars
from infthor_eval.cli.progress.notes import NOTES, print_note
from infthor_eval.errors import unknown_name
from infthor_eval.formats.object_ids import Words
from infthor_eval.storage.files import hold_folder
from infthor_eval.terminal import console, progress_bar
from infthor_eval.training.export import export
from infthor_eval.training.recipe import read_recipe_file
from infthor_eval.workers import WorkerSettings
from recipes.nano.data import generate_training_data, generate_training_views
from recipes.nano.settings import NanoRecipe
from recipes.nano.stages import TrainingData, train_small_model
from recipes.nano.steps import NanoProgress

_RECIPES = {path.stem: path for path in Path(__file__).parent.glob("*.yaml")}
_STAGES = {"vision": "recognising objects", "reading": "answering and acting"}


@example_command(
    "python -m recipes.nano", "python -m recipes.nano --recipe small --out runs/small --workers 2"
)
@click.option(
    "--recipe",
    "name",
    required=True,
    metavar="NAME|FILE",
    help="tiny; small, which is larger and takes longer; or a YAML file of the same form.",
)
@click.option(
    "--data",
    "folders",
    multiple=True,
    type=PATH,
    metavar="SET",
    help="Replayed set (`infthor-eval replay`) with questions to train on; may be repeated.  "
    "[default: one that is generated]",
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
@worker_options
def command(
    name: str,
    folders: tuple[Path, ...],
    changes: tuple[str, ...],
    words: str | None,
    out: Path,
    **workers: Any,
) -> None:
    """Train the small model from scratch, and write a checkpoint that its family's adapter loads.

    If it is stopped, the same command continues. Workers share the generation of the data.
    """
    settings = parse_pairs(changes, "--set") | ({} if words is None else {"words": words})
    train(read_nano_recipe(name, settings), folders, out, parse_worker_settings(**workers))


def read_nano_recipe(name: str, changes: dict[str, str]) -> NanoRecipe:
    """Read a recipe of this folder by its name, or from a YAML file, with changed settings."""
    if not name.endswith(".yaml") and name not in _RECIPES:
        raise unknown_name("recipe", name, sorted(_RECIPES))
    return read_recipe_file(_RECIPES.get(name, Path(name)), changes, NanoRecipe)


def train(
    recipe: NanoRecipe, folders: Sequence[Path], out: Path, worker_settings: WorkerSettings
) -> None:
    """Train on replayed sets with questions; without any, generate one in `out`.

    The views that the model learns to see from are generated in any case.
    """
    with hold_folder(out):
        sets = list(folders) or generate_training_data(
            recipe.scenes, recipe.seed, out / "data", worker_settings
        )
        views = generate_training_views(
            recipe.views, recipe.seed, out / "data" / "views", worker_settings
        )
        with progress_bar(NOTES) as progress:
            bars = StepBars(progress)

            def observe(step: NanoProgress) -> None:
                bars.advance(_STAGES[step.stage], step.step, step.n_steps, f"loss {step.loss:.3f}")

            data = TrainingData(sets, views)
            loaded = train_small_model(recipe, data, out / "states", observe, print_note)
        export(loaded, out / "checkpoint", title=recipe.title, words=recipe.words)
        console().print(f"{out / 'checkpoint'}")


if __name__ == "__main__":
    run_program(command)
