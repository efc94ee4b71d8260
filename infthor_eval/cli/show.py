"""`infthor-eval show`: the results of runs again."""

from pathlib import Path

import click

from infthor_eval.cli.showing import Showing, show, showing_options

__all__ = ["command"]


@click.command("show")
@click.argument("folders", metavar="RUN...", nargs=-1, required=True, type=click.Path(path_type=Path))
@showing_options
def command(folders: tuple[Path, ...], showing: Showing) -> None:
    """Print the results of the runs in the folders RUN..., made from their journals, as `run` prints them at its end.

    Several runs of one suite stand in one table.
    """
    from infthor_eval.cli.shown_runs import read_shown

    show([read_shown(folder) for folder in folders], showing)
