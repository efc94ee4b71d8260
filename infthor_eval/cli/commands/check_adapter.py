"""`infthor-eval check-adapter`: check a model or a policy against the adapter contract."""

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.values import parse_model_args

__all__ = ["command"]


@click.command(
    "check-adapter",
    cls=ExampleCommand,
    example="infthor-eval check-adapter ./my_adapter.py:MyModel",
)
@click.argument("model")
@click.option(
    "--model-args", default="", metavar="K=V,...", help="Options of MODEL (see `ls models`)."
)
def command(model: str, model_args: str) -> int:
    """Check MODEL, a name or your own FILE.py:CLASS, against the adapter contract.

    The model gets a few dozen short requests with frames of one colour. Each clause of the contract
    has a line of output; docs/own-models.md explains them. Exit code 1 if a clause is broken.
    """
    from infthor_eval.cli.options.checks import print_checks
    from model_adapters import run_checks
    from model_adapters.registry import build

    adapter = build(model, parse_model_args(model_args), seed=0)
    try:
        return print_checks(model, run_checks(adapter))
    finally:
        if hasattr(adapter, "close"):  # an adapter without it has been reported as broken
            adapter.close()
