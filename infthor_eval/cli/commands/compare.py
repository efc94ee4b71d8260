"""`infthor-eval compare`: two runs on the same data."""

from pathlib import Path

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.values import PATH

__all__ = ["command"]


@click.command(
    "compare",
    cls=ExampleCommand,
    example="infthor-eval compare results/oracle/RUN results/blind/RUN",
)
@click.argument("first", type=PATH)
@click.argument("second", type=PATH)
def command(first: Path, second: Path) -> None:
    """Print by how much the run in folder SECOND is better than that in FIRST.

    Units that both evaluated are paired; intervals and p values are clustered by trajectory.
    """
    from infthor_eval.cli.progress.notes import print_failure
    from infthor_eval.errors import UsageError
    from infthor_eval.report.comparison import compare, comparison_table
    from infthor_eval.report.runs import label_report_runs
    from infthor_eval.report.terminal import print_table, table_console
    from infthor_eval.runs import read_header, read_run
    from infthor_eval.suites import find_presenter, find_suite

    folders = (first, second)
    headers = [read_header(folder) for folder in folders]
    name = headers[0].suite
    other = headers[1].suite
    if name != other:
        raise UsageError(
            f"{first} is a run of {name}, {second} of {other}; compare runs of one suite"
        )
    suite = find_suite(name)
    records = [read_run(folder, suite.records, print_failure)[1] for folder in folders]
    comparisons = compare(suite, find_presenter(name), *records)
    print_table(
        comparison_table(comparisons, *label_report_runs(folders, headers)), table_console()
    )
