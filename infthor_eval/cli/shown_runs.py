"""Runs that have ended, read to be shown."""

from pathlib import Path

from infthor_eval.cli.showing import ShownRun
from infthor_eval.runs import RunSummary, read_header
from infthor_eval.runs.run_search import read_results
from infthor_eval.runs.shards import read_shards
from infthor_eval.suites import suite_named

__all__ = ["read_shown"]


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
