"""The options for how results are printed, and for the trackers that finished runs are sent to.

Trackers are named as lm-eval names them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import click

from infthor_eval.cli.options.values import parse_pairs
from infthor_eval.errors import UsageError

_TRACKERS = {
    "wandb_args": "Send finished runs to Weights & Biases: arguments of wandb.init (project=NAME).",
    "trackio_args": "Send finished runs to trackio: arguments of trackio.init (project=NAME).",
    "hf_hub_log_args": "Push finished runs to the hub: lm-eval's arguments "
    "(push_results_to_hub=True).",
}


@dataclass(frozen=True)
class ShowOptions:
    """How results are printed.

    Attributes:
        full: whether to print every scorer, column and table, and the published rows.
        format: csv, latex, markdown or json; None for tables on the terminal.
        quiet: whether to print the runs' folders alone.
    """

    full: bool = False
    format: str | None = None
    quiet: bool = False

    @classmethod
    def from_click(cls, params: Mapping[str, Any]) -> "ShowOptions":
        """Return the options among the parameters of a command, which adds --quiet itself."""
        if params["as_json"] and (params["format"] is not None or params["full"]):
            raise UsageError("--json holds everything; leave out --format and --full")
        output_format = "json" if params["as_json"] else params["format"]
        return cls(params["full"], output_format, params.get("quiet", False))


def show_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --full, --format and --json to a command, for `ShowOptions.from_click`."""
    formats = click.Choice(["csv", "latex", "markdown"])
    return _with_options(command, formats, "Write the tables in this form.")


def sample_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --per-sample and the options of `show_options`, among them a format for samples alone."""
    formats = click.Choice(["csv", "latex", "markdown", "parquet"])
    command = _with_options(
        command, formats, "Write the tables in this form; parquet has a row per sample."
    )
    return click.option(
        "--per-sample",
        is_flag=True,
        help="Write a row per sample, not tables: --format csv or --format parquet.",
    )(command)


def _with_options(
    command: Callable[..., Any], formats: click.Choice[str], help_text: str
) -> Callable[..., Any]:
    for option in (
        click.option(
            "--json", "as_json", is_flag=True, help="Print the results as JSON, as in results.json."
        ),
        click.option("--format", type=formats, help=help_text),
        click.option(
            "--full",
            is_flag=True,
            help="Show every scorer, column and table, and the published numbers.",
        ),
    ):
        command = option(command)
    return command


def tracker_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add an option for each tracker to a command, which passes them to `parse_trackers`."""
    for name, text in reversed(_TRACKERS.items()):
        command = click.option(_option(name), metavar="K=V,...", help=text)(command)
    return command


def parse_trackers(params: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Return the arguments of the trackers that are used, by option, of a command's parameters."""
    return {
        name: parse_pairs(params[name].split(","), _option(name))
        for name in _TRACKERS
        if params[name] is not None
    }


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"
