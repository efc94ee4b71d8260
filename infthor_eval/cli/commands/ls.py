"""`infthor-eval ls`: models, memories, tasks, scenes, and runs."""

import inspect
import re
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

import click
from rich import box
from rich.markup import escape
from rich.table import Table as RichTable

from infthor_eval.cli.help import ExampleGroup
from infthor_eval.cli.options.values import PATH, SCENE_KINDS, floor_plans_option, include_option
from infthor_eval.cli.progress.notes import print_failure, print_note
from infthor_eval.errors import InfthorError, ModelError, unknown_name
from infthor_eval.memory import MEMORIES, accepted_options, memory_class
from infthor_eval.rates import Rate
from infthor_eval.report.exporting import export_tables
from infthor_eval.report.terminal import print_table, table_console
from infthor_eval.run import BrokenRun, Run, find_runs, with_distinct_names
from infthor_eval.runs.catalog import Catalog, TaskFile
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.suites import baseline_suites, find_suite, split_by_suite
from infthor_eval.tables import Column, Row, Table, answered_cell
from infthor_eval.terminal import console, print_line
from model_adapters import has_option, is_known, names, options_of
from model_adapters.built_in import BUILT_IN
from model_adapters.options import shown_default
from model_adapters.registry import model_description

_TaskRow = tuple[str, str, str]  # name, description, data

_SIZE = re.compile(r"(?<=_)\d+[km]$")  # tokens, at the end of a task's name
_SIZE_HERE = "\0"  # stands for the size in a description
_MAX_TASKS = 3  # tasks of a run that are listed with their numbers
_AGES = ((86_400, "d"), (3_600, "h"), (60, "min"), (1, "s"))
_COUNTS = ("answered", "failed", "not asked")


@click.group("ls", cls=ExampleGroup, invoke_without_command=True, example="infthor-eval ls models")
@click.pass_context
def command(context: click.Context) -> None:
    """List the models, the memories, the tasks, the scenes, or the runs in a folder."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@command.command("models", example="infthor-eval ls models qwen2.5-vl")
@click.argument("name", required=False)
def _models(name: str | None) -> None:
    """Models and baselines, one a line; or the options of model NAME, with what each does."""
    if name is not None:
        _print_options(name)
        return
    table = RichTable("model", "what it is", "engine", box=box.SIMPLE_HEAD)
    for baseline, suites in baseline_suites().items():
        table.add_row(baseline, _baseline_text(suites), "-")
    for model in names():
        try:
            table.add_row(model, model_description(model) or _checkpoint(model), _engine(model))
        except ModelError as error:
            # An installed package's model that does not import: say so, list the others.
            table.add_row(model, f"not usable: {error}", "", style="red")
    table_console().print(table, soft_wrap=False)


def _print_options(model: str) -> None:
    """Print the options of a model or a baseline; raises UsageError for an unknown name."""
    suites = baseline_suites().get(model)
    if suites is None and not is_known(model):
        raise unknown_name("model", model, [*baseline_suites(), *names()])
    about = _baseline_text(suites) if suites is not None else model_description(model)
    known = {} if suites is not None else options_of(model)
    print_line(f"{model}: {about or _checkpoint(model)}" + ("" if known else "; no options"))
    if known:
        table = RichTable("--model-args", "default", "what it does", box=box.SIMPLE_HEAD)
        for name, declared in known.items():
            table.add_row(name, shown_default(declared), escape(declared.about))
        table_console().print(table, soft_wrap=False)


def _baseline_text(suites: Sequence[str]) -> str:
    return f"a baseline of {', '.join(suites)}"


def _checkpoint(model: str) -> str:
    """Return the checkpoint that a model loads unless told otherwise; an empty text for none."""
    pretrained = options_of(model).get("pretrained")
    return f"usually {pretrained.default}" if pretrained and pretrained.default else ""


def _engine(model: str) -> str:
    """Return the library that runs a model; "-" for its own code, or where nothing runs here."""
    name, _, engine = model.partition("@")
    if engine or name not in BUILT_IN:
        return engine or "-"
    return "transformers" if has_option(model, "threads") else "-"


@command.command("memories", example="infthor-eval ls memories clip")
@click.argument("name", required=False)
def _memories(name: str | None) -> None:
    """Memories for `--memory`, one a line; or the options of memory NAME, with their defaults."""
    if name is not None:
        table = RichTable("memory", "options and defaults (--memory-args)", box=box.SIMPLE_HEAD)
        defaults = {key: option.default for key, option in accepted_options(name).items()}
        text = ", ".join(f"{key}={default}" for key, default in defaults.items())
        table.add_row(name, text or "no options")
        console().print(table, soft_wrap=False)
        return
    table = RichTable("memory", "what it recalls", box=box.SIMPLE_HEAD)
    for memory in MEMORIES.names:
        try:
            paragraph = (inspect.getdoc(memory_class(memory)) or "").partition("\n\n")[0]
        except InfthorError as error:  # an installed package's memory that does not import
            table.add_row(memory, f"not usable: {error}", style="red")
        else:
            table.add_row(memory, " ".join(paragraph.split()).partition(". ")[0])
    table_console().print(table, soft_wrap=False)


@command.command("tasks", example="infthor-eval ls tasks --include-path my_tasks")
@include_option
@click.option(
    "--path",
    "as_path",
    is_flag=True,
    help="Print the folder of this package's task files alone, for lm-eval's --include_path.",
)
def _tasks(include: tuple[Path, ...], as_path: bool) -> None:
    """Tasks and groups of tasks; those that differ in a size alone in one line."""
    if as_path:
        print_line(str(packaged_folder("tasks")))
        return
    catalog = Catalog.find_installed(include)
    packaged = Catalog.find_packaged().tasks
    for suite, tasks in split_by_suite(catalog.tasks.values()).items():
        table = RichTable(suite, "what it evaluates", "data", box=box.SIMPLE_HEAD)
        for group, members in catalog.groups.items():
            if any(task in tasks for task in catalog.expand(members)):
                joined = _join_sizes([(member, "", "") for member in members], full=True)
                table.add_row(group, f"group: {', '.join(name for name, *_ in joined)}", "")
        usable = []
        unusable = []
        for task in tasks:
            try:
                if task.name not in packaged:  # which are good, and suites take long to import
                    find_suite(suite).check_task(task)
            except InfthorError as error:
                # A file of one's own, or another package's: say so, list the others.
                unusable.append((task.name, f"not usable: {error}", ""))
            else:
                usable.append(_task_row(task))
        for row in _join_sizes(usable):
            table.add_row(*row)
        for row in unusable:
            table.add_row(*row, style="red")
        table_console().print(table, soft_wrap=False)


def _task_row(task: TaskFile) -> _TaskRow:
    settings = dict(task.settings.get("dataset_kwargs", {}))
    data = settings.pop("bundled", "--data")
    without_description = ", ".join(f"{name} {value}" for name, value in settings.items())
    return task.name, task.description or without_description, str(data)


def _join_sizes(rows: Iterable[_TaskRow], *, full: bool = False) -> list[_TaskRow]:
    """Join the tasks that differ in the size at their names' end alone into one row each.

    Args:
        rows: name, description and data of each task; descriptions have sizes in capitals.
        full: whether to write every size of several, rather than the first and the last.
    """
    families: dict[_TaskRow, list[str]] = {}
    for name, about, data in rows:
        match = _SIZE.search(name)
        size = match[0] if match is not None else ""
        pattern = about.replace(size.upper(), _SIZE_HERE) if size else about
        families.setdefault((name.removesuffix(size), pattern, data), []).append(size)
    joined = []
    for (stem, pattern, data), sizes in families.items():
        text = sizes[0]
        if len(sizes) > 1:
            ordered = sorted(sizes, key=_tokens)
            listed = ordered if full or len(ordered) == 2 else [ordered[0], "...", ordered[-1]]
            text = f"{{{','.join(listed)}}}"
        joined.append((f"{stem}{text}", pattern.replace(_SIZE_HERE, text.upper()), data))
    return joined


def _tokens(size: str) -> int:
    """Return the thousands of tokens of a size at the end of a task's name, such as 8k or 1m."""
    return int(size[:-1]) * (1000 if size.endswith("m") else 1)


@command.command("scenes", example="infthor-eval ls scenes")
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


@command.command("runs", example="infthor-eval ls runs results")
@click.argument("folder", metavar="[DIR]", type=PATH, default=Path("results"))
@click.option(
    "--format",
    "output_format",
    type=click.Choice(["csv", "latex", "markdown"]),
    help="Write the table in this form.",
)
def _runs(folder: Path, output_format: str | None) -> None:
    """Runs below DIR (default: results): units by state; primary metrics of tasks."""
    runs = list(find_runs(folder, print_failure))
    stored = with_distinct_names([run for run in runs if isinstance(run, Run)])
    if not runs:
        print_line(f"no runs in {folder}; `infthor-eval --model MODEL --tasks TASKS` starts one")
    if stored:
        columns = (Column("run", False), Column("suite", False), *map(Column, _COUNTS))
        more = (Column("tasks, %", False), Column("age"), Column("folder", False))
        rows = tuple(map(_row, stored))
        table = Table("", (*columns, *more), rows)
        if output_format is None:
            print_table(table, table_console())
        else:
            click.echo(export_tables([table], output_format))
    for run in runs:
        if isinstance(run, BrokenRun):
            print_note(f"{run.folder}: cannot be read: {run.reason}", "red")


def _row(run: Run) -> Row:
    n_not_asked = "?" if run.n_not_asked is None else str(run.n_not_asked)
    counts = (str(run.states["answered"]), str(run.states["failed"]), n_not_asked)
    age = _age(time.time() - run.changed.timestamp())
    return Row((run.label, run.listed.suite, *counts, _numbers(run), age, str(run.folder)))


def _numbers(run: Run) -> str:
    """The tasks with their primary metrics, as many as fit into a row."""
    tasks = list(run.listed.config.tasks)
    numbers = []
    for task in tasks[:_MAX_TASKS]:
        metric = run.primary_metrics.get(task)
        numbers.append(task if metric is None else f"{task} {_mean(metric)}")
    if len(tasks) > _MAX_TASKS:
        numbers.append(f"{len(tasks) - _MAX_TASKS} more")
    return ", ".join(numbers)


def _mean(metric: Rate) -> str:
    return answered_cell(f"{100 * metric.mean:.1f}", metric.n, metric.n_all or metric.n)


def _age(seconds: float) -> str:
    size, unit = next((pair for pair in _AGES if seconds >= pair[0]), _AGES[-1])
    return f"{max(0, seconds) / size:.0f} {unit}"
