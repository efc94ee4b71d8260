"""`evaluate` for notebooks and scripts: what the command does, without its process."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.errors import UsageError

if TYPE_CHECKING:
    from pandas import DataFrame


def evaluate(options: Mapping[str, Any]) -> DataFrame:
    """See `infthor_eval.evaluate`."""
    from infthor_eval.cli.commands.run import command
    from infthor_eval.cli.options.run import RunOptions
    from infthor_eval.cli.progress.runs import execute_runs
    from infthor_eval.exports.lm_eval import export
    from infthor_eval.report.run_table import load_runs
    from infthor_eval.runs import prepare_all

    try:
        context = command.make_context("evaluate", list(_words(options)))
        requests = RunOptions.from_click(context.params).requests()
    except click.ClickException as error:
        raise UsageError(error.format_message()) from error
    runs = prepare_all(requests)
    outcomes, is_stopped = execute_runs(runs, finish=export)
    if is_stopped:
        raise KeyboardInterrupt
    return load_runs(*(outcome.folder for outcome in outcomes))


def _words(options: Mapping[str, Any]) -> Iterator[str]:
    """Yield options as they are typed: `model_args={"a": 1}` is `--model-args a=1`."""
    for name, value in options.items():
        if value is None or value is False:
            continue
        yield f"--{name.replace('_', '-')}"
        if value is not True:
            yield _typed(value)


def _typed(value: Any) -> str:
    if isinstance(value, Mapping):
        return ",".join(f"{key}={item}" for key, item in value.items())
    if isinstance(value, list | tuple):
        return ",".join(map(str, value))
    return str(value)
