"""`infthor-eval table4`: the paper's Table 4 from the published question files."""

from pathlib import Path

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.values import PATH

__all__ = ["command"]


@click.command("table4", cls=ExampleCommand, example="infthor-eval table4 SET")
@click.argument("set_folder", metavar="SET", type=PATH)
def command(set_folder: Path) -> None:
    """Compute the paper's Table 4 from the scores in the published question files, beside the
    printed table.

    SET is a folder with both files. It needs no frames.
    """
    from infthor_eval.cli.progress.left_out import print_left_out
    from infthor_eval.formats.nieh_set import NiehSet
    from infthor_eval.nieh.published.table4 import table4
    from infthor_eval.report.terminal import print_table, table_console

    data = NiehSet(set_folder)
    print_left_out(data.root, data.skipped)
    print_table(table4(data), table_console())
