"""The options of a run, for every command that takes them: from what was typed to its requests."""

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.cli.options.config import comes_from_file, config_option
from infthor_eval.cli.options.suites import refuse_twins, suite_options
from infthor_eval.cli.options.values import FiniteRange, ModelOptions, ModelsAsked, Whole, include_option, names_in
from infthor_eval.cli.options.workers import worker_options
from infthor_eval.workers import WorkerSettings

if TYPE_CHECKING:
    from infthor_eval.runs import RunRequest, Suite

__all__ = ["run_options"]

_OPTIONS = (
    click.option(
        "--model",
        "models",
        type=ModelsAsked(),
        required=True,
        metavar="MODEL,...",
        help="Model name, or several with commas (see `ls models`); MODEL:K=V,... gives one options of its own.",
    ),
    click.option(
        "--engine",
        type=click.Choice(["transformers", "vllm"]),
        help="What runs the model: transformers, unless its name says otherwise, or vLLM.",
    ),
    click.option("--tasks", required=True, help="Task or group names with commas (see `ls tasks`)."),
    include_option,
    click.option("--data", type=click.Path(path_type=Path), help="Folder of the data set to ask about."),
    click.option(
        "--model-args",
        type=ModelOptions(),
        default="",
        metavar="K=V,...",
        help="Options of the model, or of all of them (see `ls models`).",
    ),
    click.option(
        "--rope",
        metavar="TYPE:FACTOR",
        help="Extend the model's context: yarn:4, linear:2, dynamic:4, longrope:8.",
    ),
    click.option(
        "--max-tokens-total",
        type=Whole(1),
        metavar="N",
        help="Ask a served model nothing more once a run has taken so many tokens.",
    ),
    click.option(
        "--max-cost",
        type=FiniteRange(min=0, min_open=True),
        metavar="USD",
        help="Nor once it has cost so much, by the prices in --model-args.",
    ),
    click.option("--name", help="What the run is called in tables and folders; else by its checkpoint, or its model."),
    click.option(
        "--limit",
        type=Whole(1),
        metavar="N",
        help="Ask only N of each task (questions, trajectories of plans, episodes of arms), evenly from all "
        "trajectories, drawn by --seed; a larger N asks these too. lm-eval's own command takes the first N instead.",
    ),
    click.option(
        "--output",
        type=click.Path(path_type=Path),
        default=Path("results"),
        show_default=True,
        help="Results folder.",
    ),
    click.option("--seed", type=Whole(), default=0, show_default=True, help="For whatever is random."),
    click.option("--fresh", is_flag=True, help="Start anew; the journal of an earlier run is set aside."),
    click.option("--recover", is_flag=True, help="Go on without the bad lines of a damaged journal."),
)


def run_options(*own: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add all options of a run to a command, which is given what they ask for as `requests`.

    Args:
        own: names of the command's own parameters, which it is given as they are.
    """

    def with_options(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def with_requests(**given: Any) -> Any:
            kept = {name: given.pop(name) for name in own}
            return command(requests=_requests(**given), **kept)

        options = (config_option, *_OPTIONS, worker_options, suite_options)
        made = functools.reduce(lambda wrapped, option: option(wrapped), reversed(options), with_requests)
        refuse_twins(made)
        return made

    return with_options


def _requests(
    models: Mapping[str, Mapping[str, str]],
    engine: str | None,
    tasks: str,
    include: tuple[Path, ...],
    model_args: Mapping[str, str],
    name: str | None,
    data: Path | None,
    limit: int | None,
    seed: int,
    output: Path,
    fresh: bool,
    recover: bool,
    worker_settings: WorkerSettings,
    rope: str | None,
    max_tokens_total: int | None,
    max_cost: float | None,
    **suites: Any,
) -> "list[tuple[RunRequest, Suite]]":
    from infthor_eval.cli.options.requests import Asked, requests_for
    from model_adapters import name_on_engine

    of_all = _with_short_ones(model_args, {"rope": rope, "max_tokens_total": max_tokens_total, "max_cost": max_cost})
    options = {model: {**of_all, **own} for model, own in models.items()}
    _refuse_shared_caps(options, worker_settings)
    asked = Asked(
        tasks=names_in(tasks, "--tasks"),
        include=include,
        data=data,
        limit=limit,
        seed=seed,
        output=output,
        fresh=fresh,
        recover=recover,
        worker_settings=worker_settings,
        suite_options=suites,
    )
    if name is not None and len(options) > 1:
        raise click.UsageError(f"--name {name}: names one run, and {len(options)} models are asked")
    if engine is not None:
        options = {name_on_engine(model, engine): given for model, given in options.items()}
    return [request for model, given in options.items() for request in requests_for(asked, model, given, name)]


def _with_short_ones(model_args: Mapping[str, str], short: Mapping[str, Any]) -> dict[str, str]:
    """The options of all models, with those that have an option of the command for themselves."""
    options = dict(model_args)
    for option, value in short.items():
        if value is None:
            continue
        if option in options and comes_from_file(option) == comes_from_file("model_args"):
            typed = f"--{option.replace('_', '-')}"
            raise click.UsageError(f"{typed} and {option}= in --model-args are the same option; give one of them")
        if option not in options or not comes_from_file(option):
            options[option] = str(value)
    return options


def _refuse_shared_caps(options: Mapping[str, Mapping[str, str]], worker_settings: WorkerSettings) -> None:
    capped = sorted({"max_tokens_total", "max_cost"} & {name for given in options.values() for name in given})
    if capped and not worker_settings.is_local:
        raise click.UsageError(f"{capped[0]} counts what one process asks for; leave out --workers, or the cap")
