"""The command line: one thin module per command, imported when the command is called."""

import sys

try:
    from infthor_eval.cli.main import main
except KeyboardInterrupt:  # Ctrl-C during the imports, which take a third of a second
    print("infthor-eval: stopped; run the same command to continue", file=sys.stderr)
    sys.exit(130)

__all__ = ["main"]
