"""`infthor-eval show`: the results of runs again."""

from pathlib import Path

import click

from infthor_eval.cli.showing import Showing, ShownRun, show, showing_options
from infthor_eval.runs import RunSummary, read_header
from infthor_eval.runs.run_search import read_results
from infthor_eval.runs.shards import read_shards
from infthor_eval.suites import suite_named

__all__ = ["command", "read_shown"]


@click.command("show")
@click.argument("folders", metavar="RUN...", nargs=-1, required=True, type=click.Path(path_type=Path))
@showing_options
def command(folders: tuple[Path, ...], showing: Showing) -> None:
    """Print the results of the runs in the folders RUN..., made from their journals, as `run` prints them at its end.

    Several runs of one suite stand in one table.
    """
    show([read_shown(folder) for folder in folders], showing)


def read_shown(folder: Path) -> ShownRun:
    """The run in a folder, summed up from its journal.

    Raises:
        DataError: there is no journal, or one with a bad line, or of another format.
        UsageError: its suite is not known here.
    """
    header = read_header(folder)
    suite = suite_named(header.suite)
    log, results = read_shards(folder, suite.records.decoder()), read_results(folder)
    found = RunSummary(header, suite.summarise(header, log.records))
    return ShownRun(folder, suite, found, log.usage, results.n_missing if results else None)
