"""The options for how results are printed, and for the trackers that finished runs are sent to.

Trackers are named as lm-eval names them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import click

from infthor_eval.cli.options.values import parse_pairs, together
from infthor_eval.errors import UsageError

_FORMATS = ("csv", "latex", "markdown")
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


def _options(formats: Sequence[str], help_text: str) -> Callable[..., Any]:
    """Return --full, --format and --json, for `ShowOptions.from_click`."""
    return together(
        click.option(
            "--full",
            is_flag=True,
            help="Show every scorer, column and table, and the published numbers.",
        ),
        click.option("--format", type=click.Choice(formats), help=help_text),
        click.option(
            "--json", "as_json", is_flag=True, help="Print the results as JSON, as in results.json."
        ),
    )


def _name(tracker: str) -> str:
    return f"--{tracker.replace('_', '-')}"


show_options = _options(_FORMATS, "Write the tables in this form.")
# The same with --per-sample, and a format for samples alone.
sample_options = together(
    click.option(
        "--per-sample",
        is_flag=True,
        help="Write a row per sample, not tables: --format csv or --format parquet.",
    ),
    _options(
        (*_FORMATS, "parquet"), "Write the tables in this form; parquet has a row per sample."
    ),
)
# An option for each tracker; a command passes them to `parse_trackers`.
tracker_options = together(
    *(click.option(_name(one), metavar="K=V,...", help=text) for one, text in _TRACKERS.items())
)


def parse_trackers(params: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Return the arguments of the trackers that are used, by option, of a command's parameters."""
    return {
        name: parse_pairs(params[name].split(","), _name(name))
        for name in _TRACKERS
        if params[name] is not None
    }
