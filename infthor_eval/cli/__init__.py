"""The command line: one thin module per command, imported when the command is called."""

from infthor_eval.cli.main import main

__all__ = ["main"]
