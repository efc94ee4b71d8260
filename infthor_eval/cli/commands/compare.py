"""`infthor-eval compare`: two runs on the same data."""

from pathlib import Path

import click

from infthor_eval.cli.help import ExampleCommand

__all__ = ["command"]


@click.command("compare", cls=ExampleCommand, example="infthor-eval compare results/oracle/RUN results/blind/RUN")
@click.argument("first", type=click.Path(path_type=Path))
@click.argument("second", type=click.Path(path_type=Path))
def command(first: Path, second: Path) -> None:
    """Say by how much the run in folder SECOND is better than that in FIRST.

    What both evaluated is paired; intervals and p values are clustered by trajectory.
    """
    from infthor_eval.errors import UsageError
    from infthor_eval.report.comparison import compare, comparison_table
    from infthor_eval.report.terminal import print_table, table_console
    from infthor_eval.runs import read_header, read_run
    from infthor_eval.suites import suite_named

    headers = [read_header(folder) for folder in (first, second)]
    if headers[0].suite != headers[1].suite:
        raise UsageError(f"{first} is a run of {headers[0].suite}, {second} of {headers[1].suite}; compare like runs")
    suite = suite_named(headers[0].suite)
    records = [read_run(folder, suite.records)[1] for folder in (first, second)]
    names = [header.name for header in headers]
    if names[0] == names[1]:  # the folders' names tell them apart
        names = [f"{name} ({folder.name})" for name, folder in zip(names, (first, second), strict=True)]
    print_table(comparison_table(compare(suite, *records), *names), table_console())
