"""What `ls` shows of what there is to evaluate, and on what."""

from collections.abc import Sequence
from pathlib import Path

from rich import box
from rich.table import Table

from infthor_eval.errors import ModelError
from infthor_eval.terminal import console

__all__ = ["models", "scenes", "tasks"]


def models() -> None:
    """Print all models, and the baselines of the suites."""
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
    console().print(table, soft_wrap=False)


def tasks(include: Sequence[Path]) -> None:
    """Print all tasks, and the groups of them.

    Args:
        include: folders with further task files.

    Raises:
        UsageError: a task file cannot be read.
    """
    from infthor_eval.runs.catalog import Catalog

    catalog = Catalog.installed(include)
    table = Table("task", "what it is", box=box.SIMPLE_HEAD)
    for name, members in catalog.groups.items():
        table.add_row(name, f"group of {', '.join(members)}")
    for name, task in catalog.tasks.items():
        settings = task.settings.get("dataset_kwargs", {})
        data = f"the bundled set {settings['bundled']}" if "bundled" in settings else "the set given with --data"
        context = f"context {settings['context']}, " if "context" in settings else ""
        table.add_row(name, f"{task.suite}: {context}{data}")
    console().print(table, soft_wrap=False)


def scenes(data: Path | None) -> None:
    """Print the scenes that there are.

    Args:
        data: folder with recorded floor plans; None for the made ones alone.

    Raises:
        DataError: the folder has none.
    """
    table = Table("scene", "what it is", box=box.SIMPLE_HEAD)
    for room in ("kitchen", "living-room", "bedroom", "bathroom"):
        table.add_row(f"{room}-<seed>", f"a {room.replace('-', ' ')} made from the seed")
    table.add_row("house-<seed>", "a house of several rooms made from the seed")
    if data is not None:
        from infthor_eval.formats.floor_plans import floor_plan_names

        for name in floor_plan_names(data):
            table.add_row(name, f"recorded, in {data}")
    console().print(table, soft_wrap=False)
