"""The options of a run, for every command that takes them, and the runs that they ask for.

To add an option of a run: here, and in `infthor_eval/runs/stored/command.py`, which stores a run's
command, unless a suite has it.
"""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import MISSING, dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import click
import msgspec

from infthor_eval.cli.help import SuiteOption
from infthor_eval.cli.options.config import comes_from_file, config_option
from infthor_eval.cli.options.values import (
    SET,
    FiniteFloat,
    ModelArgs,
    ModelList,
    ModelSpec,
    WholeNumber,
    default_option,
    include_option,
    output_option,
    split_names,
    together,
)
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options
from infthor_eval.errors import UsageError
from infthor_eval.runs import Catalog, RunRequest, Suite, TaskRequest
from infthor_eval.settings import Declared, Shorthand, settings_of
from infthor_eval.suites import (
    baseline_suites,
    find_suite,
    options_class,
    split_by_suite,
    suite_code,
    suite_names,
)
from infthor_eval.workers import WorkerSettings
from model_adapters import has_option, is_known, name_on_engine

_OPTIONS = (
    click.option(
        "--model",
        "models",
        type=ModelList(),
        required=True,
        metavar="MODEL,...",
        help="Model name, or several with commas (see `ls models`); MODEL:K=V,... gives a model "
        "its own options, and it may be named again with others.",
    ),
    click.option(
        "--engine",
        type=click.Choice(["transformers", "vllm"]),
        help="Library that runs the model; default: transformers, unless its name says otherwise.",
    ),
    click.option(
        "--tasks",
        required=True,
        metavar="TASK,...",
        help="Task or group names with commas (see `ls tasks`).",
    ),
    include_option,
    click.option(
        "--data",
        type=SET,
        help="Folder of the data set, or a packed one on the hub: hf://OWNER/NAME.",
    ),
    click.option(
        "--model-args",
        type=ModelArgs(),
        default="",
        metavar="K=V,...",
        help="Options of the model, or of all of them (see `ls models NAME`).",
    ),
    click.option(
        "--rope",
        metavar="TYPE:FACTOR",
        help="Extend the model's context: yarn:4, linear:2, dynamic:4, longrope:8, "
        "longrope-scaled:8.",
    ),
    click.option(
        "--threads",
        type=WholeNumber(1),
        metavar="N",
        help="Processor threads of each model on a CPU; default: all, and one for models with "
        "-tiny or -nano.",
    ),
    click.option(
        "--max-tokens-total",
        type=WholeNumber(1),
        metavar="N",
        help="Stop sending requests to a served model after N tokens.",
    ),
    click.option(
        "--max-cost",
        type=FiniteFloat(min=0, min_open=True),
        metavar="USD",
        help="Stop sending them at this cost, by the prices in --model-args.",
    ),
    click.option(
        "--name",
        help="Name of the run in tables and folders; default: its checkpoint, or its model.",
    ),
    click.option(
        "--limit",
        type=WholeNumber(1),
        metavar="N",
        help="Evaluate only N of each task (questions, trajectories of plans, episodes of arms), "
        "evenly from all trajectories, drawn by --seed; a larger N includes these. lm-eval's own "
        "command takes the first N instead.",
    ),
    output_option,
    default_option("--seed", WholeNumber(), 0, "Seed of everything random."),
    click.option(
        "--fresh",
        is_flag=True,
        help="Restart; the journal of an earlier run is kept under another name.",
    ),
    click.option(
        "--recover", is_flag=True, help="Resume without the bad lines of a damaged journal."
    ),
)
# Options of the command that are options of the model.
_MODEL_OPTIONS = ("rope", "max_tokens_total", "max_cost")
_CAPS = ("max_tokens_total", "max_cost")
_AS_GIVEN = ("data", "output", "limit", "seed", "name", "fresh", "recover", "include")


def run_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add all options of a run to a command, for `RunOptions.from_click`."""
    command = together(config_option, *_OPTIONS, worker_options, _add_suite_options)(command)
    _refuse_duplicate_options(command)
    return command


@dataclass(frozen=True)
class RunOptions:
    """The options of a run.

    Attributes:
        models: models to evaluate.
        tasks: names of tasks and groups.
        data: folder of the data set; None for that of the tasks.
        output: results folder.
        limit: units of each task; None for all.
        seed: seed of the runs.
        name: name of the run; None for the checkpoint's or the model's.
        fresh: whether to set an earlier journal aside.
        recover: whether to resume without bad lines.
        worker_settings: number and place of the workers.
        include: folders with further task files.
        suite_options: options of all suites by name; None where not given.
    """

    models: tuple[ModelSpec, ...]
    tasks: tuple[str, ...]
    data: Path | None
    output: Path
    limit: int | None = None
    seed: int = 0
    name: str | None = None
    fresh: bool = False
    recover: bool = False
    worker_settings: WorkerSettings = field(default_factory=WorkerSettings)
    include: tuple[Path, ...] = ()
    suite_options: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def from_click(cls, params: Mapping[str, Any]) -> "RunOptions":
        """Return the options among the parameters of a command."""
        for_all = _options_of_all_models(params)
        engine = params["engine"]
        specs = []
        for name, options in params["models"]:
            on_engine = name_on_engine(name, engine) if engine else name
            specs.append(ModelSpec(on_engine, {**for_all, **options}))
        models = _with_threads(params["threads"], specs)
        workers = parse_worker_settings(
            params["workers"], params["ray_address"], params["gpus_per_worker"]
        )
        used = {option for model in models for option in model.options}
        capped = next((cap for cap in _CAPS if cap in used), None)
        if capped and not workers.is_local:
            raise click.UsageError(
                f"{capped} counts the requests of one process; leave out --workers, or the cap"
            )
        if params["name"] is not None and len(models) > 1:
            raise click.UsageError(
                f"--name {params['name']}: names one run, but {len(models)} models are given"
            )
        return cls(
            models=models,
            tasks=split_names(params["tasks"], "--tasks"),
            worker_settings=workers,
            suite_options=_suite_values(params),
            **{name: params[name] for name in _AS_GIVEN},
        )

    def requests(self) -> list[tuple[RunRequest, Suite]]:
        """Return a run and its suite for each model, suite, and value of an `each` option."""
        if self.name is not None and not re.fullmatch(r"\w[\w.@+ -]*", self.name):
            raise UsageError(
                f"--name {self.name!r}: names a folder; use letters, digits, '.', '_', '-', '@', "
                "'+' and blanks"
            )
        by_suite = split_by_suite(Catalog.find_installed(self.include).expand(self.tasks))
        requests = []
        for model in self.models:
            for suite, tasks in by_suite.items():
                # The folder of one suite's run has the tasks' names as typed; of several, each
                # its own tasks.
                names = tuple(task.name for task in tasks)
                typed_names = self.tasks if len(by_suite) == 1 else names
                _refuse_baseline_of_others(model.name, suite, tasks[0].name)
                for options in expand_suite_options(suite, self.suite_options, by_suite.keys()):
                    request = RunRequest(
                        model=model.name,
                        tasks=TaskRequest(tasks, options, self.data, self.limit, self.seed),
                        task_names=typed_names,
                        output=self.output,
                        model_options=model.options,
                        name=self.name,
                        fresh=self.fresh,
                        recover=self.recover,
                        worker_settings=self.worker_settings,
                        include=self.include,
                        suite_code=suite_code(suite),
                    )
                    requests.append((request, find_suite(suite)))
        return requests


def _refuse_baseline_of_others(model: str, suite: str, task: str) -> None:
    suites = baseline_suites().get(model, (suite,))
    if suite not in suites and not is_known(model):
        raise UsageError(
            f"{model} is a baseline of {', '.join(suites)}, and {task} is a task of {suite}; see "
            "`ls models`"
        )


def _with_threads(threads: int | None, models: Sequence[ModelSpec]) -> tuple[ModelSpec, ...]:
    """Give the number of threads to the models that compute here, unless they have their own."""
    if threads is None:
        return tuple(models)
    computing = {
        model.name for model in models if is_known(model.name) and has_option(model.name, "threads")
    }
    if not computing:
        raise UsageError(
            f"--threads {threads}: {models[0].name} takes no threads; give them to a model "
            "that runs on this machine"
        )
    own = {"threads": str(threads)}
    return tuple(
        ModelSpec(model.name, {**own, **model.options}) if model.name in computing else model
        for model in models
    )


def _options_of_all_models(params: Mapping[str, Any]) -> dict[str, str]:
    """The options in --model-args, with those that are options of the command as well."""
    options = dict(params["model_args"])
    for name in _MODEL_OPTIONS:
        if params[name] is None:
            continue
        if name in options and comes_from_file(name) == comes_from_file("model_args"):
            typed = f"--{name.replace('_', '-')}"
            raise click.UsageError(
                f"{typed} and {name}= in --model-args are the same option; give one of them"
            )
        if name not in options or not comes_from_file(name):  # what is typed wins over the file
            options[name] = str(params[name])
    return options


def _add_suite_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of every suite to a command, which passes them to `_suite_values`.

    Suites with an option of one name share it; its help has the text of each.
    """
    for name, flags in _shorthands().items():
        command = click.option(
            f"--{name}",
            cls=SuiteOption,
            suites=tuple(flags),
            is_flag=True,
            default=None,
            help=next(iter(flags.values())).help,
        )(command)
    for name, by_suite in reversed(_options_by_name().items()):
        option = next(iter(by_suite.values()))
        kind, setting = option.kind, option.setting
        choices = () if setting.each else tuple(map(str, setting.choices))
        types = {bool: None, int: WholeNumber()} if not setting.each else {kind: str}
        command = click.option(
            f"--{name.replace('_', '-')}",
            cls=SuiteOption,
            suites=tuple(by_suite),
            type=click.Choice(choices) if choices else types.get(kind, kind),
            is_flag=kind is bool,
            default=None,
            metavar=setting.metavar,
            help=_help(by_suite),
        )(command)
    return command


def _suite_values(params: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of all suites among the parameters of a command; None where not given."""
    # A suite that was installed after the command was imported has options that the command does
    # not know.
    return {name: params.get(name) for name in (*_options_by_name(), *_shorthands())}


def expand_suite_options(suite: str, params: Mapping[str, Any], used: Collection[str]) -> list[Any]:
    """Return the options of a suite for each of its runs.

    An option with `each` takes several values with commas, and there is a run for each of them. A
    flag in its `shorthands` stands for such values.

    Args:
        suite: name of the suite.
        params: options of all suites by name; None where not given.
        used: names of the suites that the tasks belong to.
    """
    _refuse_unused(params, used)
    values: dict[str, list[Any]] = {}
    for name, option in settings_of(options_class(suite)).items():
        value = _value(name, option, params)
        if value is not None:
            typed = split_names(value, f"--{name}") if option.setting.each else (value,)
            values[name] = [_convert(name, option, value) for value in typed]
        elif option.default is MISSING:
            raise UsageError(
                f"--{name.replace('_', '-')}: {suite} needs it, as its field has no "
                "default; give it"
            )
    return [
        options_class(suite)(**dict(zip(values, chosen, strict=True)))
        for chosen in product(*values.values())
    ]


def _convert(name: str, option: Declared, text: Any) -> Any:
    try:
        return msgspec.convert(text, option.kind, strict=False)
    except msgspec.ValidationError as error:
        raise UsageError(f"--{name.replace('_', '-')} {text}: give {option.valid}") from error


def _refuse_duplicate_options(command: Callable[..., Any]) -> None:
    """Refuse options of another package's suite that the command, which has those of all suites,
    has already.
    """
    options: list[click.Parameter] = command.__click_params__  # type: ignore[attr-defined]
    names = [option.name for option in options]
    duplicates = sorted({str(name) for name in names if names.count(name) > 1})
    if duplicates:
        suite = next(iter(_options_by_name()[duplicates[0]]))
        raise UsageError(
            f"the option {duplicates[0]} of the suite {suite} is one of every run; give it another "
            "name"
        )


def _value(name: str, option: Declared, params: Mapping[str, Any]) -> Any:
    """Return what is given for an option, by itself or by a flag that stands for its values."""
    value = params.get(name)
    for flag in option.setting.shorthands:
        if params.get(flag.name):
            if value is not None:
                raise UsageError(
                    f"--{flag.name} and --{name}: the first is --{name} {flag.values}; give one of "
                    "them"
                )
            return flag.values
    return value


def _options_by_name() -> dict[str, dict[str, Declared]]:
    """The options of all suites by name, then by suite."""
    options: dict[str, dict[str, Declared]] = {}
    for suite in suite_names():
        for name, option in settings_of(options_class(suite)).items():
            options.setdefault(name, {})[suite] = option
    return options


def _shorthands() -> dict[str, dict[str, Shorthand]]:
    """The flags for several values of an option: by name, then by suite."""
    flags: dict[str, dict[str, Shorthand]] = {}
    for by_suite in _options_by_name().values():
        for suite, option in by_suite.items():
            for flag in option.setting.shorthands:
                flags.setdefault(flag.name, {})[suite] = flag
    return flags


def _refuse_unused(params: Mapping[str, Any], used: Collection[str]) -> None:
    every: dict[str, Mapping[str, Any]] = {**_options_by_name(), **_shorthands()}
    for name, by_suite in every.items():
        if params.get(name) is not None and not set(by_suite) & set(used):
            raise UsageError(
                f"--{name.replace('_', '-')} is for tasks of {' and '.join(by_suite)}; --tasks "
                "names none of these"
            )


def _help(by_suite: Mapping[str, Declared]) -> str:
    """The text of all suites, or those of each with its name."""
    suites: dict[str, list[str]] = {}
    for suite, option in by_suite.items():
        suites.setdefault(option.setting.help, []).append(suite)
    if len(suites) == 1:
        return next(iter(suites))
    return " ".join(f"{text} [{', '.join(names)}]" for text, names in suites.items())
