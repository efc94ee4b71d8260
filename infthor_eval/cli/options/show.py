"""The options for how results are printed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import click

from infthor_eval.errors import UsageError

__all__ = ["ShowOptions", "sample_options", "show_options"]


@dataclass(frozen=True)
class ShowOptions:
    """How results are printed.

    Attributes:
        full: whether to print every scorer, column and table, and the published rows.
        form: csv, latex, markdown or json; None for tables on the terminal.
        quiet: whether to print the runs' folders alone.
    """

    full: bool = False
    form: str | None = None
    quiet: bool = False

    @classmethod
    def from_click(cls, given: Mapping[str, Any]) -> "ShowOptions":
        """Return the options among the parameters of a command; one with --quiet adds that option
        itself.

        Raises:
            UsageError: --json with --format or --full.
        """
        if given["as_json"] and (given["form"] is not None or given["full"]):
            raise UsageError("--json holds everything; leave out --format and --full")
        return cls(
            given["full"], "json" if given["as_json"] else given["form"], given.get("quiet", False)
        )


def show_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --full, --format and --json to a command, which passes them to
    `ShowOptions.from_click`."""
    return _with_options(
        command, click.Choice(["csv", "latex", "markdown"]), "Write the tables in this form."
    )


def sample_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --per-sample and the options of `show_options`, among them a form for samples alone."""
    forms = click.Choice(["csv", "latex", "markdown", "parquet"])
    command = _with_options(
        command, forms, "Write the tables in this form; parquet has a row per sample."
    )
    return click.option(
        "--per-sample",
        is_flag=True,
        help="Write a row per sample, not tables: --format csv or --format parquet.",
    )(command)


def _with_options(
    command: Callable[..., Any], forms: click.Choice[str], help_text: str
) -> Callable[..., Any]:
    for option in (
        click.option(
            "--json", "as_json", is_flag=True, help="Print the results as JSON, as in results.json."
        ),
        click.option("--format", "form", type=forms, help=help_text),
        click.option(
            "--full",
            is_flag=True,
            help="Show every scorer, column and table, and the published numbers.",
        ),
    ):
        command = option(command)
    return command
