"""`infthor-eval show`: the results of runs again."""

import sys
from pathlib import Path
from typing import Any

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.show import ShowOptions, sample_options
from infthor_eval.cli.options.values import PATH
from infthor_eval.cli.results import print_results, read_run_results

__all__ = ["command"]


@click.command(
    "show",
    cls=ExampleCommand,
    example="infthor-eval show results/oracle/RUN results/blind/RUN --full",
)
@click.argument("folders", metavar="RUN...", nargs=-1, required=True, type=PATH)
@sample_options
def command(folders: tuple[Path, ...], per_sample: bool, **params: Any) -> None:
    """Print the results of the runs in the folders RUN..., made from their journals, as `run`
    prints them at its end.

    Several runs of one suite stand in one table. With `--per-sample` the samples are printed
    instead, for other programs: `infthor-eval show RUN --format parquet > samples.parquet`.
    """
    options = ShowOptions.from_click(params)
    if per_sample or options.format == "parquet":
        _print_samples(folders, options)
    else:
        print_results([read_run_results(folder) for folder in folders], options)


def _print_samples(folders: tuple[Path, ...], options: ShowOptions) -> None:
    from infthor_eval.errors import UsageError
    from infthor_eval.report.presented import read_report_runs
    from infthor_eval.report.sample_table import FORMS, encode_samples, sample_table

    if options.format not in FORMS or options.full:
        raise UsageError(
            f"--per-sample: is for --format {' and --format '.join(FORMS)}, and --full is for "
            "tables"
        )
    if options.format == "parquet" and sys.stdout.isatty():
        raise UsageError(
            "--format parquet: is not for a terminal; write it into a file, `> samples.parquet`"
        )
    table = sample_table(read_report_runs(folders))
    sys.stdout.buffer.write(encode_samples(table, options.format))
