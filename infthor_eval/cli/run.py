"""`infthor-eval run`: evaluate a model on tasks."""

from typing import Any

import click

from infthor_eval.cli.run_options import run_options
from infthor_eval.cli.showing import SHOWING, Showing, showing_options
from infthor_eval.cli.tracker_options import TRACKERS, tracker_options

__all__ = ["command"]


@click.command("run")
@run_options(*SHOWING, *TRACKERS)
@showing_options
@tracker_options
@click.option("--quiet", is_flag=True, help="Say nothing but what failed; print the runs' folders alone.")
def command(requests: Any, showing: Showing, trackers: Any) -> int:
    """Evaluate MODEL on TASKS and print the results; --full prints all of them, beside the published ones.

    Stop it whenever you like: the same command goes on where it was.
    """
    from infthor_eval.cli.evaluate import evaluate

    return evaluate(requests, showing, trackers)
