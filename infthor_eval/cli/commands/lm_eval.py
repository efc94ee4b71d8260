"""`infthor-eval lm-eval`: lm-eval's own command, which knows these models."""

import sys

import click

__all__ = ["command"]


@click.command(
    "lm-eval", context_settings={"ignore_unknown_options": True, "help_option_names": []}
)
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
def command(arguments: tuple[str, ...]) -> None:
    """Run lm-eval's own command with ARGUMENTS, with `--model infthor` registered.

    lm-eval 0.4.13 reads no entry points, so its own script finds this model only if a task is given
    as a file.
    """
    from lm_eval.__main__ import cli_evaluate

    from infthor_eval.harness.registration import register

    register()
    sys.argv = ["lm-eval", *arguments]
    cli_evaluate()
