"""`infthor-eval table-final`: the paper's table of final tasks from the published plan logs."""

from pathlib import Path

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.values import PATH

__all__ = ["command"]


@click.command(
    "table-final", cls=ExampleCommand, example="infthor-eval table-final LOGS/eval_longhrz_*.log"
)
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=PATH)
def command(logs: tuple[Path, ...]) -> int:
    """Compute the paper's table of final long-horizon tasks from the published plan logs, beside
    the printed table.

    The name of a LOG says which row it is; a log of another name has a row of its own. A line
    without counts is counted and named; the exit code is then 1.
    """
    from infthor_eval.cli.progress.refused_lines import print_refused
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
