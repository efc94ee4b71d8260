"""`infthor-eval run`: evaluate a model on tasks."""

from typing import Any

import click

from infthor_eval.cli.run_options import run_options

__all__ = ["command"]


@click.command("run")
@run_options()
def command(requests: Any) -> int:
    """Evaluate MODEL on TASKS and print the results beside the published ones.

    Stop it whenever you like: the same command goes on where it was.
    """
    from infthor_eval.cli.evaluate import evaluate

    return evaluate(requests)
