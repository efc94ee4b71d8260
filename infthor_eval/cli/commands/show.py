"""`infthor-eval show`: the results of runs again."""

from pathlib import Path
from typing import Any

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.show import ShowOptions, show_options
from infthor_eval.cli.options.values import PATH
from infthor_eval.cli.results import print_results, read_run_results

__all__ = ["command"]


@click.command("show", cls=ExampleCommand, example="infthor-eval show results/oracle/RUN results/blind/RUN --full")
@click.argument("folders", metavar="RUN...", nargs=-1, required=True, type=PATH)
@show_options
def command(folders: tuple[Path, ...], **given: Any) -> None:
    """Print the results of the runs in the folders RUN..., made from their journals, as `run` prints them at its end.

    Several runs of one suite stand in one table.
    """
    options = ShowOptions.from_click(given)
    print_results([read_run_results(folder) for folder in folders], options)
