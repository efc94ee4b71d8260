"""How results are shown: on a terminal, as a file for another program, briefly or in full."""

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.errors import UsageError

if TYPE_CHECKING:
    from infthor_eval.runs import RunSummary, Suite, Usage
    from infthor_eval.tables import Table

__all__ = ["SHOWING", "Showing", "ShownRun", "show", "showing_options"]

SHOWING = ("full", "form", "as_json", "quiet")  # the parameters behind a `Showing`


@dataclass(frozen=True)
class Showing:
    """How results are shown.

    Attributes:
        full: every scorer, column and table, and the published rows.
        form: csv, latex, markdown or json; None is for people.
        quiet: of people's: the runs' folders alone.
    """

    full: bool = False
    form: str | None = None
    quiet: bool = False


@dataclass(frozen=True)
class ShownRun:
    """A run whose results are shown.

    Attributes:
        folder: its own.
        suite: that knows its tables.
        found: who it is, and what it found.
        usage: what its requests took.
        n_missing: units that it did not come to; None where that is not known.
    """

    folder: Path
    suite: "Suite"
    found: "RunSummary"
    usage: "Usage"
    n_missing: int | None


def showing_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --full, --format and --json to a command, which is given one `Showing` as `showing`.

    A command that has --quiet as well adds it itself.
    """

    @click.option("--full", is_flag=True, help="Show every scorer, column and table, and the published numbers.")
    @click.option(
        "--format",
        "form",
        type=click.Choice(["csv", "latex", "markdown"]),
        help="Write the tables in this form.",
    )
    @click.option("--json", "as_json", is_flag=True, help="Write what the runs found as JSON, as in results.json.")
    @functools.wraps(command)
    def with_showing(*args: Any, full: bool, form: str | None, as_json: bool, quiet: bool = False, **rest: Any) -> Any:
        if as_json and (form is not None or full):
            raise UsageError("--json holds everything; leave out --format and --full")
        return command(*args, showing=Showing(full, "json" if as_json else form, quiet), **rest)

    return with_showing


def show(runs: Sequence[ShownRun], showing: Showing) -> None:
    """Print what runs found, on standard output: one set of tables per suite."""
    if showing.form == "json":
        _print_json(runs)
        return
    if not showing.quiet:
        _print_tables(runs, showing)
    if showing.form is None:
        _print_folders(runs, showing)


def _print_json(runs: Sequence[ShownRun]) -> None:
    import msgspec

    from infthor_eval.runs.results import results_document

    documents = [
        {"folder": str(run.folder), **results_document(run.found, run.suite, run.n_missing, run.usage)} for run in runs
    ]
    click.echo(msgspec.json.format(msgspec.json.encode(documents, order="sorted"), indent=2))


def _print_tables(runs: Sequence[ShownRun], showing: Showing) -> None:
    from infthor_eval.report.exporting import exported
    from infthor_eval.report.terminal import print_table, table_console

    tables: list[Table] = []
    for _, of_suite in groupby(sorted(runs, key=_suite_name), key=_suite_name):
        same = list(of_suite)
        make = same[0].suite.tables if showing.full else same[0].suite.overview
        tables += make([run.found for run in same])
    if showing.form is not None:
        click.echo(exported(tables, showing.form))
        return
    console = table_console()
    for table in tables:
        print_table(table, console)


def _print_folders(runs: Sequence[ShownRun], showing: Showing) -> None:
    from infthor_eval.terminal import print_line

    for run in runs:
        if showing.quiet:
            print_line(str(run.folder))
            continue
        if run.usage.requests:
            print_line(f"{run.found.header.name}: {run.usage.description}")
        print_line(f"{run.found.header.name}: {run.folder}")


def _suite_name(run: ShownRun) -> str:
    return run.suite.name
