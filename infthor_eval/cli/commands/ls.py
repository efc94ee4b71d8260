"""`infthor-eval ls`: what there is to evaluate, on what, and what was evaluated."""

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import click
from rich import box
from rich.table import Table as RichTable

from infthor_eval.cli.options.values import floor_plans_option, include_option
from infthor_eval.cli.progress.notes import print_note
from infthor_eval.errors import ModelError
from infthor_eval.report.terminal import print_table, table_console
from infthor_eval.runs.run_labels import label_runs
from infthor_eval.runs.run_search import BrokenRun, StoredRun, find_runs
from infthor_eval.tables import Column, Row, Table
from infthor_eval.terminal import console, print_line

__all__ = ["command", "models", "runs", "scenes", "tasks"]

_MOST = 3  # tasks that a row tells the number of
_AGES = ((86_400, "d"), (3_600, "h"), (60, "min"), (1, "s"))
_NUMBERS = ("done", "missing", "failed")


@click.group("ls", invoke_without_command=True)
@click.pass_context
def command(context: click.Context) -> None:
    """List the models with their options, the tasks, the scenes, or the runs in a folder."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@command.command("models")
def _models() -> None:
    """Models and baselines, with their options and defaults."""
    models()


@command.command("tasks")
@include_option
def _tasks(include: tuple[Path, ...]) -> None:
    """Tasks and groups of tasks."""
    tasks(include)


@command.command("scenes")
@floor_plans_option
def _scenes(data: Path | None) -> None:
    """Scenes of the embedded simulator."""
    scenes(data)


@command.command("runs")
@click.argument("folder", metavar="[DIR]", type=click.Path(path_type=Path), default=Path("results"))
def _runs(folder: Path) -> None:
    """Runs below DIR (results, if not given): units done, missing and failed, and each task's headline number."""
    runs(folder)


def models() -> None:
    """Print all models, and the baselines of the suites."""
    from infthor_eval.suites import baseline_names
    from model_adapters import names, options

    table = RichTable("model", "options and defaults (--model-args)", box=box.SIMPLE_HEAD)
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
    table = RichTable("task", "what it is", box=box.SIMPLE_HEAD)
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
    table = RichTable("scene", "what it is", box=box.SIMPLE_HEAD)
    for room in ("kitchen", "living-room", "bedroom", "bathroom"):
        table.add_row(f"{room}-<seed>", f"a {room.replace('-', ' ')} made from the seed")
    table.add_row("house-<seed>", "a house of several rooms made from the seed")
    if data is not None:
        from infthor_eval.formats.floor_plans import floor_plan_names

        for name in floor_plan_names(data):
            table.add_row(name, f"recorded, in {data}")
    console().print(table, soft_wrap=False)


def runs(folder: Path) -> None:
    """Print the runs below a folder; those that cannot be read are named.

    Raises:
        DataError: there is no such folder.
    """
    found = list(find_runs(folder))
    whole = [item for item in found if isinstance(item, StoredRun)]
    if not found:
        print_line(f"no runs in {folder}; infthor-eval --model MODEL --tasks TASKS makes one")
    if whole:
        columns = (Column("run", False), Column("suite", False), *map(Column, _NUMBERS))
        more = (Column("tasks, %", False), Column("age"), Column("folder", False))
        labels = label_runs([(item.folder, item.header) for item in whole])
        rows = tuple(Row((label, *_cells(item))) for label, item in zip(labels, whole, strict=True))
        print_table(Table("", (*columns, *more), rows), table_console())
    for item in found:
        if isinstance(item, BrokenRun):
            print_note(f"{item.folder}: cannot be read: {item.reason}", "red")


def _cells(run: StoredRun) -> Iterator[str]:
    yield run.header.suite
    yield from (str(run.n_done), "?" if run.n_missing is None else str(run.n_missing), str(run.n_failed))
    yield _numbers(run)
    yield _age(time.time() - run.changed)
    yield str(run.folder)


def _numbers(run: StoredRun) -> str:
    """The tasks, each with the number that it is known by, as far as a row has room."""
    tasks = list(run.header.config.get("tasks", {}))
    told = [
        f"{task} {100 * run.primary_metrics[task].mean:.1f}" if task in run.primary_metrics else task
        for task in tasks[:_MOST]
    ]
    return ", ".join([*told, *([f"{len(tasks) - _MOST} more"] if len(tasks) > _MOST else [])])


def _age(seconds: float) -> str:
    size, unit = next((pair for pair in _AGES if seconds >= pair[0]), _AGES[-1])
    return f"{max(0, seconds) / size:.0f} {unit}"
