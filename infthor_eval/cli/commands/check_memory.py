"""`infthor-eval check-memory`: check a memory against the contract of memories."""

import click

from infthor_eval.cli.help import ExampleCommand

__all__ = ["command"]


@click.command(
    "check-memory", cls=ExampleCommand, example="infthor-eval check-memory ./my_memory.py:MyMemory"
)
@click.argument("memory")
@click.option(
    "--memory-args", default="", metavar="K=V,...", help="Options of MEMORY (see `ls memories`)."
)
def command(memory: str, memory_args: str) -> int:
    """Check MEMORY, a name or your own FILE.py:CLASS, against the contract of memories.

    The memory observes short trajectories of plain frames and is asked on them. Each clause of the
    contract has a line of output; docs/memories.md explains them. Exit code 1 if a clause is
    broken.
    """
    from infthor_eval.cli.options.checks import print_checks
    from infthor_eval.memory import open_memory, parse_options
    from infthor_eval.memory.check import check_memory

    options = parse_options(memory_args) or {}
    return print_checks(memory, check_memory(open_memory(memory, tuple(sorted(options.items())))))
