"""Results of runs on standard output: tables, or a format for another program."""

from collections.abc import Iterable, Sequence
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from typing import Any

import click
import msgspec

from infthor_eval.cli.options.show import ShowOptions
from infthor_eval.cli.progress.notes import print_failure
from infthor_eval.reasons import count_reasons
from infthor_eval.report.exporting import export_tables
from infthor_eval.report.terminal import print_table, table_console
from infthor_eval.run import Run, with_distinct_names
from infthor_eval.runs import UnitRecord
from infthor_eval.runs.results import results_document
from infthor_eval.tables import Table
from infthor_eval.terminal import print_line


def print_failures(records: Iterable[UnitRecord[Any]], folder: Path | None = None) -> int:
    """Print why units have no result, a line for each task and reason; return how many these are.

    Args:
        records: the records of a run.
        folder: its folder, where several runs are spoken of.
    """
    failed = [
        ((record.task, record.state), record.failure)
        for record in records
        if record.failure is not None
    ]
    where = "" if folder is None else f"{folder}: "
    for (task, state), reason, n in count_reasons(failed):
        what = "failed, in no score: " if state == "failed" else ""  # else the reason says so
        print_failure(f"{where}{task}: {n} sample(s) {what}{reason}")
    return len(failed)


def print_results(runs: Sequence[Run], options: ShowOptions) -> None:
    """Print the results of runs, with one set of tables for each suite."""
    if options.format == "json":
        _print_json(runs)
        return
    labelled = with_distinct_names(runs)
    if not options.quiet:
        _print_tables(labelled, options)
    if options.format is None:
        _print_folders(labelled, options.quiet)


def _print_json(runs: Sequence[Run]) -> None:
    documents = [
        {
            "folder": str(run.folder),
            **results_document(run.own_summary, run.suite, run.n_missing, run.usage),
        }
        for run in runs
    ]
    click.echo(msgspec.json.format(msgspec.json.encode(documents, order="sorted"), indent=2))


def _print_tables(runs: Sequence[Run], options: ShowOptions) -> None:
    tables: list[Table] = []
    suite_name = attrgetter("suite.name")
    for _, group in groupby(sorted(runs, key=suite_name), key=suite_name):
        same_suite = list(group)
        suite = same_suite[0].suite
        make_tables = suite.tables if options.full else suite.overview
        tables += make_tables([run.summary for run in same_suite])
    if options.format is not None:
        click.echo(export_tables(tables, options.format))
        return
    console = table_console()
    for table in tables:
        print_table(table, console)


def _print_folders(runs: Sequence[Run], quiet: bool) -> None:
    for run in runs:
        if not quiet and run.usage.requests:
            print_line(f"{run.label}: {run.usage.description}")
        print_line(str(run.folder) if quiet else f"{run.label}: {run.folder}")
