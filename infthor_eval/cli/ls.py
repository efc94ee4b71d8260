"""`infthor-eval ls`: what there is to evaluate, and on what."""

import click
from rich import box
from rich.console import Console
from rich.table import Table

from infthor_eval.errors import ModelError

__all__ = ["command"]


@click.command("ls")
@click.argument("what", type=click.Choice(["models", "tasks"]))
def command(what: str) -> None:
    """List the models with their options, or the tasks."""
    Console().print(_models() if what == "models" else _tasks())


def _models() -> Table:
    from model_adapters import names, options

    table = Table("model", "options and defaults (--model-args)", box=box.SIMPLE_HEAD)
    for name in names():
        try:
            table.add_row(name, options(name))
        except ModelError as error:  # an installed package's model that does not import: say so, list the others
            table.add_row(name, f"not usable: {error}", style="red")
    return table


def _tasks() -> Table:
    from infthor_eval.runs import Catalog

    catalog = Catalog.packaged()
    table = Table("task", "what it is", box=box.SIMPLE_HEAD)
    for name, members in catalog.groups.items():
        table.add_row(name, f"group of {', '.join(members)}")
    for name, config in catalog.tasks.items():
        settings = config["dataset_kwargs"]
        data = f"the bundled set {settings['bundled']}" if "bundled" in settings else "the set given with --data"
        table.add_row(name, f"context {settings['context']}, {data}")
    return table
