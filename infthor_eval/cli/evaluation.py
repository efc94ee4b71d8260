"""`evaluate` for notebooks and scripts: what the command does, without its process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.errors import UsageError

if TYPE_CHECKING:
    from pandas import DataFrame


def evaluate(options: Mapping[str, Any]) -> DataFrame:
    """See `infthor_eval.evaluate`; the options are taken as those of `--config` are."""
    from infthor_eval.cli.commands.run import command
    from infthor_eval.cli.options.config import take_options
    from infthor_eval.cli.options.run import RunOptions
    from infthor_eval.cli.progress.runs import execute_runs
    from infthor_eval.cli.progress.undrawn import draw_missing
    from infthor_eval.exports.lm_eval import export
    from infthor_eval.report.run_table import load_runs
    from infthor_eval.runs import prepare_all

    try:
        context = click.Context(command, info_name="evaluate")
        take_options(context, options, "evaluate")
        with context.scope(cleanup=False):
            command.parse_args(context, [])
            requests = RunOptions.from_click(context.params).requests()
    except click.ClickException as error:
        raise UsageError(error.format_message()) from error
    draw_missing(requests)
    runs = prepare_all(requests)
    outcomes, is_stopped = execute_runs(runs, finish=export)
    if is_stopped:
        raise KeyboardInterrupt
    return load_runs(*(outcome.folder for outcome in outcomes))
