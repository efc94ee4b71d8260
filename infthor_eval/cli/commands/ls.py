"""`infthor-eval ls`: models, memories, tasks, scenes, and runs."""

import inspect
import time
from pathlib import Path

import click
from rich import box
from rich.table import Table as RichTable

from infthor_eval.cli.help import ExampleCommand, ExampleGroup
from infthor_eval.cli.options.values import PATH, SCENE_KINDS, floor_plans_option, include_option
from infthor_eval.cli.progress.notes import print_note
from infthor_eval.errors import InfthorError, ModelError
from infthor_eval.memory import MEMORIES, accepted_options, memory_class
from infthor_eval.report.terminal import print_table, table_console
from infthor_eval.runs.catalog import Catalog
from infthor_eval.runs.stored.labels import label_runs
from infthor_eval.runs.stored.search import BrokenRun, StoredRun, find_runs
from infthor_eval.suites import baseline_suites, find_suite, split_by_suite
from infthor_eval.tables import Column, Row, Table
from infthor_eval.terminal import console, print_line
from model_adapters import names, options
from model_adapters.registry import model_description

__all__ = ["command"]

_MAX_TASKS = 3  # tasks of a run that are listed with their numbers
_AGES = ((86_400, "d"), (3_600, "h"), (60, "min"), (1, "s"))
_COUNTS = ("done", "missing", "failed")


@click.group("ls", cls=ExampleGroup, invoke_without_command=True, example="infthor-eval ls models")
@click.pass_context
def command(context: click.Context) -> None:
    """List the models with their options, the memories, the tasks, the scenes, or the runs in a
    folder."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@command.command("models", cls=ExampleCommand, example="infthor-eval ls models")
def _models() -> None:
    """Models and baselines, with their options and defaults."""
    table = RichTable("model", "options and defaults (--model-args)", box=box.SIMPLE_HEAD)
    for name, suites in baseline_suites().items():
        table.add_row(name, f"no options; a baseline of {', '.join(suites)}")
    for name in names():
        try:
            note = model_description(name)
            table.add_row(name, f"{note}; {options(name)}" if note else options(name))
        except (
            ModelError
        ) as error:  # an installed package's model that does not import: say so, list the others
            table.add_row(name, f"not usable: {error}", style="red")
    console().print(table, soft_wrap=False)


@command.command("memories", cls=ExampleCommand, example="infthor-eval ls memories")
def _memories() -> None:
    """Memories for `--memory`, with their options and defaults."""
    table = RichTable(
        "memory", "what it recalls", "options and defaults (--memory-args)", box=box.SIMPLE_HEAD
    )
    for name in MEMORIES.names:
        try:
            shown = ", ".join(
                f"{key}={item.default}" for key, item in accepted_options(name).items()
            )
            about = (inspect.getdoc(memory_class(name)) or "").partition("\n")[0]
        except InfthorError as error:  # an installed package's memory that does not import
            table.add_row(name, f"not usable: {error}", "", style="red")
        else:
            table.add_row(name, about, shown or "-")
    console().print(table, soft_wrap=False)


@command.command(
    "tasks", cls=ExampleCommand, example="infthor-eval ls tasks --include-path my_tasks"
)
@include_option
def _tasks(include: tuple[Path, ...]) -> None:
    """Tasks and groups of tasks."""
    catalog = Catalog.find_installed(include)
    packaged = Catalog.find_packaged().tasks
    for suite, tasks in split_by_suite(catalog.tasks.values()).items():
        table = RichTable(suite, "what it evaluates", "data", box=box.SIMPLE_HEAD)
        for group, members in catalog.groups.items():
            if any(task in tasks for task in catalog.expand(members)):
                table.add_row(group, f"group: {', '.join(members)}", "")
        for task in tasks:
            try:
                if task.name not in packaged:  # which are good, and suites take long to import
                    find_suite(suite).check_task(task)
            except (
                InfthorError
            ) as error:  # a file of one's own, or another package's: say so, list the others
                table.add_row(task.name, f"not usable: {error}", "", style="red")
                continue
            settings = dict(task.settings.get("dataset_kwargs", {}))
            data = settings.pop("bundled", "--data")
            without_description = ", ".join(f"{name} {value}" for name, value in settings.items())
            table.add_row(task.name, task.description or without_description, str(data))
        console().print(table, soft_wrap=False)


@command.command("scenes", cls=ExampleCommand, example="infthor-eval ls scenes")
@floor_plans_option
def _scenes(data: Path | None) -> None:
    """Scenes of the embedded simulator."""
    table = RichTable("scene", "what it is", box=box.SIMPLE_HEAD)
    for kind in SCENE_KINDS:
        several = " of several rooms" if kind == "house" else ""
        table.add_row(
            f"{kind}-<seed>", f"a {kind.replace('-', ' ')}{several}, generated from the seed"
        )
    if data is not None:
        from infthor_eval.formats.floor_plans import floor_plan_names

        for name in floor_plan_names(data):
            table.add_row(name, f"recorded, in {data}")
    console().print(table, soft_wrap=False)


@command.command("runs", cls=ExampleCommand, example="infthor-eval ls runs results")
@click.argument("folder", metavar="[DIR]", type=PATH, default=Path("results"))
def _runs(folder: Path) -> None:
    """Runs below DIR (default: results): units done, missing and failed, and the primary metric of
    each task."""
    runs = list(find_runs(folder))
    stored = [run for run in runs if isinstance(run, StoredRun)]
    if not runs:
        print_line(f"no runs in {folder}; `infthor-eval --model MODEL --tasks TASKS` starts one")
    if stored:
        columns = (Column("run", False), Column("suite", False), *map(Column, _COUNTS))
        more = (Column("tasks, %", False), Column("age"), Column("folder", False))
        labels = label_runs([(run.folder, run.header) for run in stored])
        rows = tuple(_row(label, run) for label, run in zip(labels, stored, strict=True))
        print_table(Table("", (*columns, *more), rows), table_console())
    for run in runs:
        if isinstance(run, BrokenRun):
            print_note(f"{run.folder}: cannot be read: {run.reason}", "red")


def _row(label: str, run: StoredRun) -> Row:
    n_missing = "?" if run.n_missing is None else str(run.n_missing)
    age = _age(time.time() - run.changed)
    return Row(
        (
            label,
            run.header.suite,
            str(run.n_done),
            n_missing,
            str(run.n_failed),
            _numbers(run),
            age,
            str(run.folder),
        )
    )


def _numbers(run: StoredRun) -> str:
    """The tasks with their primary metrics, as many as fit into a row."""
    tasks = list(run.header.config.tasks)
    numbers = [
        f"{task} {100 * run.primary_metrics[task].mean:.1f}"
        if task in run.primary_metrics
        else task
        for task in tasks[:_MAX_TASKS]
    ]
    return ", ".join(
        [*numbers, *([f"{len(tasks) - _MAX_TASKS} more"] if len(tasks) > _MAX_TASKS else [])]
    )


def _age(seconds: float) -> str:
    size, unit = next((pair for pair in _AGES if seconds >= pair[0]), _AGES[-1])
    return f"{max(0, seconds) / size:.0f} {unit}"
