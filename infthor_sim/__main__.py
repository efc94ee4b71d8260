"""`python -m infthor_sim run SCRIPT [ARGUMENTS]`: run a script for AI2-THOR on the simulator."""

import builtins
import sys
from argparse import REMAINDER, ArgumentParser, RawDescriptionHelpFormatter
from pathlib import Path
from typing import NoReturn

from infthor_sim.errors import DataError

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
    run.add_argument("script", help="a Python script, or a folder or zip with __main__.py")
    rest = run.add_argument("arguments", nargs=REMAINDER, help="the script's own arguments")
    rest.required = False  # else argparse names it, too, where the script is missing
    options = parser.parse_args(words)
    if options.command is None:
        parser.print_help()
        return
    if not sys.flags.safe_path:
        del sys.path[0]  # the folder where one stands, whose modules are not the script's
    from infthor_sim.script import prepare_script, use_simulator

    use_simulator(options.data, options.supplement)
    try:
        script, code = prepare_script(options.script)
    except DataError as error:
        run.error(str(error))
    sys.argv = [options.script, *options.arguments]
    sys.modules["__main__"] = script
    script.__dict__["__builtins__"] = builtins
    exec(code, script.__dict__)


if __name__ == "__main__":
    main(sys.argv[1:])
