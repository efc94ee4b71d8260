"""Results of runs on standard output: tables, or a format for another program."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
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
from infthor_eval.runs import (
    RunSummary,
    Suite,
    UnitRecord,
    Usage,
    mark_incomplete,
    read_header,
)
from infthor_eval.runs.completeness import count_missing
from infthor_eval.runs.journals.shards import read_run_log
from infthor_eval.runs.results import results_document
from infthor_eval.runs.stored.labels import label_runs
from infthor_eval.runs.stored.search import read_results
from infthor_eval.suites import find_suite
from infthor_eval.tables import Table
from infthor_eval.terminal import print_line

_SHOWN_BY_TABLES = {"frames"}  # the options that the suites' tables show beside a run's name


@dataclass(frozen=True)
class RunResults:
    """The results of a run.

    Attributes:
        folder: folder of the run.
        suite: suite of the run, which builds its tables.
        summary: header and summary of the run.
        usage: requests, tokens and cost.
        n_missing: units that were not attempted; None where that is not known.
    """

    folder: Path
    suite: Suite
    summary: RunSummary
    usage: Usage
    n_missing: int | None


def read_run_results(folder: Path) -> tuple[RunResults, Sequence[UnitRecord[Any]]]:
    """The run in a folder, summed up from its journal, and its records; bad lines are named and
    left out.

    Raises:
        DataError: there is no journal, or one of another format.
        UsageError: its suite is not known here.
    """
    suite = find_suite(read_header(folder).suite)
    header, log = read_run_log(folder, suite.records, print_failure)
    results = read_results(folder)
    summary = RunSummary.of(suite, header, log.records)
    n_missing = count_missing(header, len(log.records))
    if n_missing is None and results is not None:
        n_missing = results.n_missing
    return RunResults(folder, suite, summary, log.usage, n_missing), log.records


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


def print_results(runs: Sequence[RunResults], options: ShowOptions) -> None:
    """Print the results of runs, with one set of tables for each suite."""
    if options.format == "json":
        _print_json(runs)
        return
    labelled = _with_labels(runs)
    if not options.quiet:
        _print_tables(labelled, options)
    if options.format is None:
        _print_folders(labelled, options.quiet)


def _print_json(runs: Sequence[RunResults]) -> None:
    documents = [
        {
            "folder": str(run.folder),
            **results_document(run.summary, run.suite, run.n_missing, run.usage),
        }
        for run in runs
    ]
    click.echo(msgspec.json.format(msgspec.json.encode(documents, order="sorted"), indent=2))


def _with_labels(runs: Sequence[RunResults]) -> list[RunResults]:
    """The runs with labels for names, which tell those of one name apart."""
    labels = label_runs([(run.folder, run.summary.header) for run in runs], _SHOWN_BY_TABLES)
    labelled = []
    for run, label in zip(runs, labels, strict=True):
        name = mark_incomplete(label, run.summary.units, run.n_missing)
        header = msgspec.structs.replace(run.summary.header, name=name)
        labelled.append(replace(run, summary=replace(run.summary, header=header)))
    return labelled


def _print_tables(runs: Sequence[RunResults], options: ShowOptions) -> None:
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


def _print_folders(runs: Sequence[RunResults], quiet: bool) -> None:
    for run in runs:
        name = run.summary.header.name
        if not quiet and run.usage.requests:
            print_line(f"{name}: {run.usage.description}")
        print_line(str(run.folder) if quiet else f"{name}: {run.folder}")
