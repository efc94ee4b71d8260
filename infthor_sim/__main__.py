"""`python -m infthor_sim run SCRIPT [ARGUMENTS]`: run a script for AI2-THOR on the simulator."""

import sys
from argparse import REMAINDER, ArgumentParser, RawDescriptionHelpFormatter
from pathlib import Path
from typing import NoReturn

_HELP = """\
AI2-THOR's Controller without Unity, on a CPU.

In Python:
  from infthor_sim import Controller
  with Controller(scene="kitchen-1") as controller:
      event = controller.step("MoveAhead")

A script that imports ai2thor.controller.Controller, unchanged:
  python -m infthor_sim run SCRIPT [ARGUMENTS]
"""


class _Parser(ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}; see {self.prog} --help\n")


def main(words: list[str] | None = None) -> None:
    """Run the command; misuse is one line and exit code 2."""
    parser = _Parser(
        prog="python -m infthor_sim", description=_HELP, formatter_class=RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", metavar="run")
    run = commands.add_parser("run", help="run a Python script on the simulator")
    run.add_argument("--data", type=Path, metavar="DIR", help="folder of recorded floor plans")
    run.add_argument("--supplement", type=Path, metavar="FILE", help="file with additions to them")
    run.add_argument("script", type=Path, help="a Python script")
    rest = run.add_argument("arguments", nargs=REMAINDER, help="the script's own arguments")
    rest.required = False  # else argparse names it, too, where the script is missing
    options = parser.parse_args(words)
    if options.command is None:
        parser.print_help()
        return
    if not options.script.is_file():
        run.error(f"there is no file {options.script}")
    from infthor_sim.script import run_script

    run_script(options.script, options.arguments, options.data, options.supplement)


if __name__ == "__main__":
    main(sys.argv[1:])
