"""`infthor-eval show`: the results of runs again."""

from pathlib import Path
from typing import Any

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.show import ShowOptions, show_options
from infthor_eval.cli.options.values import PATH
from infthor_eval.cli.results import RunResults, print_results
from infthor_eval.runs import RunSummary, read_header
from infthor_eval.runs.run_search import read_results
from infthor_eval.runs.shards import read_shards
from infthor_eval.suites import find_suite

__all__ = ["command", "read_run_results"]


@click.command("show", cls=ExampleCommand, example="infthor-eval show results/oracle/RUN results/blind/RUN --full")
@click.argument("folders", metavar="RUN...", nargs=-1, required=True, type=PATH)
@show_options
def command(folders: tuple[Path, ...], **given: Any) -> None:
    """Print the results of the runs in the folders RUN..., made from their journals, as `run` prints them at its end.

    Several runs of one suite stand in one table.
    """
    options = ShowOptions.from_click(given)
    print_results([read_run_results(folder) for folder in folders], options)


def read_run_results(folder: Path) -> RunResults:
    """The run in a folder, summed up from its journal.

    Raises:
        DataError: there is no journal, or one with a bad line, or of another format.
        UsageError: its suite is not known here.
    """
    header = read_header(folder)
    suite = find_suite(header.suite)
    log, results = read_shards(folder, suite.records.decoder()), read_results(folder)
    summary = RunSummary(header, suite.summarise(header, log.records))
    return RunResults(folder, suite, summary, log.usage, results.n_missing if results else None)
