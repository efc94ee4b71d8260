"""`infthor-eval ls`: what there is to evaluate, and on what."""

from pathlib import Path

import click
from rich import box
from rich.table import Table

from infthor_eval.cli.options import floor_plans_option
from infthor_eval.errors import ModelError
from infthor_eval.terminal import console

__all__ = ["command"]


@click.command("ls")
@click.argument("what", type=click.Choice(["models", "tasks", "scenes"]))
@floor_plans_option
def command(what: str, data: Path | None) -> None:
    """List the models with their options, the tasks, or the embedded simulator's scenes."""
    found = {"models": _models, "tasks": _tasks}[what]() if what != "scenes" else _scenes(data)
    console().print(found, soft_wrap=False)


def _models() -> Table:
    from infthor_eval.suites import baseline_names
    from model_adapters import names, options

    table = Table("model", "options and defaults (--model-args)", box=box.SIMPLE_HEAD)
    for name, suites in baseline_names().items():
        table.add_row(name, f"no options; a baseline of {suites}")
    for name in names():
        try:
            table.add_row(name, options(name))
        except ModelError as error:  # an installed package's model that does not import: say so, list the others
            table.add_row(name, f"not usable: {error}", style="red")
    return table


def _tasks() -> Table:
    from infthor_eval.runs import Catalog

    catalog = Catalog.installed()
    table = Table("task", "what it is", box=box.SIMPLE_HEAD)
    for name, members in catalog.groups.items():
        table.add_row(name, f"group of {', '.join(members)}")
    for name, task in catalog.tasks.items():
        settings = task.settings.get("dataset_kwargs", {})
        data = f"the bundled set {settings['bundled']}" if "bundled" in settings else "the set given with --data"
        table.add_row(name, f"{task.suite}: context {settings.get('context')}, {data}")
    return table


def _scenes(data: Path | None) -> Table:
    from infthor_eval.formats.floor_plans import floor_plan_names

    table = Table("scene", "what it is", box=box.SIMPLE_HEAD)
    for room in ("kitchen", "living-room", "bedroom", "bathroom"):
        table.add_row(f"{room}-<seed>", f"a {room.replace('-', ' ')} made from the seed")
    table.add_row("house-<seed>", "a house of several rooms made from the seed")
    for name in floor_plan_names(data) if data else ():
        table.add_row(name, f"recorded, in {data}")
    return table
