"""`infthor-eval check-adapter`: hold a model or a policy to the contract of adapters."""

import click

from infthor_eval.cli.options.values import parse_model_args

__all__ = ["command"]


@click.command("check-adapter")
@click.argument("model")
@click.option("--model-args", default="", metavar="K=V,...", help="Options of MODEL (see `ls models`).")
def command(model: str, model_args: str) -> int:
    """Check that MODEL keeps the contract of adapters: a name, or FILE.py:CLASS of your own.

    It is asked a few dozen short questions on frames of one colour. A line per clause says whether it holds
    (docs/own-models.md has what each asks). Exits with 0 where all hold, with 1 where one is broken.
    """
    from infthor_eval.terminal import print_line
    from model_adapters import load, run_checks

    n_broken = 0
    adapter = load(model, parse_model_args(model_args), seed=0)
    try:
        for finding in run_checks(adapter):
            found = "holds" if finding.broken is None else "broken"
            print_line(f"{found:8}{finding.about:16}{finding.broken or ''}".rstrip())
            n_broken += finding.broken is not None
    finally:
        if hasattr(adapter, "close"):  # what lacks it has been told so
            adapter.close()
    print_line(f"{model}: {f'{n_broken} broken' if n_broken else 'keeps the contract'}")
    return int(n_broken > 0)
