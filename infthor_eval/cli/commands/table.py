"""`table 4` and `table final`: tables of the paper from its published files."""

from pathlib import Path

import click

from infthor_eval.cli.help import ExampleGroup
from infthor_eval.cli.options.values import PATH, SET
from infthor_eval.cli.progress.notes import print_left_out, print_refused


@click.group("table", cls=ExampleGroup, example="infthor-eval table 4 SET")
def command() -> None:
    """Compute a table of the paper from its published files."""


@command.command("4", example="infthor-eval table 4 SET")
@click.argument("set_folder", metavar="SET", type=SET)
def table4(set_folder: Path) -> None:
    """Compute the paper's Table 4 from the scores in the published question files, beside the
    printed table.

    SET is a folder with both files. It needs no frames.
    """
    from infthor_eval.formats.nieh_set import NiehSet
    from infthor_eval.nieh.published import table4 as published
    from infthor_eval.report.terminal import print_table, table_console

    data = NiehSet(set_folder)
    print_left_out(data.root, data.skipped)
    print_table(published.table4(data), table_console())


@command.command("final", example="infthor-eval table final LOGS/eval_longhrz_*.log")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=PATH)
def table_final(logs: tuple[Path, ...]) -> int:
    """Compute the paper's table of final long-horizon tasks from the published plan logs, beside
    the printed table.

    The name of a LOG says which row it is; a log of another name has a row of its own. A line
    without counts is counted and named; the exit code is then 1.
    """
    from infthor_eval.formats.plan_logs import read_plan_log
    from infthor_eval.plans.published.final_table import final_table
    from infthor_eval.report.terminal import print_table, table_console

    read = [read_plan_log(log) for log in logs]
    for log in read:
        print_refused(
            log.path.name, "not read", [(log.path, row.line, row.reason) for row in log.unread]
        )
    print_table(final_table(read), table_console())
    return 1 if any(log.unread for log in read) else 0
