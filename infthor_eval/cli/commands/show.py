"""`infthor-eval show`: the results of runs again, or what is in trajectory files."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.show import ShowOptions, sample_options
from infthor_eval.cli.options.values import PATH
from infthor_eval.cli.progress.notes import print_failure
from infthor_eval.cli.results import print_failures, print_results
from infthor_eval.errors import UsageError
from infthor_eval.formats.trajectory import is_trajectory_file
from infthor_eval.run import Run, open_runs
from infthor_eval.terminal import print_line


@example_command("show", "infthor-eval show results/oracle/RUN results/blind/RUN --full")
@click.argument("paths", metavar="RUN|TRAJECTORY...", nargs=-1, required=True, type=PATH)
@sample_options
@click.option(
    "--question",
    metavar="ID",
    help="Show one sample of the runs: question, reply, and why it got its score.",
)
def command(paths: tuple[Path, ...], per_sample: bool, question: str | None, **params: Any) -> None:
    """Print the results of the runs in the folders RUN..., made from their journals, as `run`
    prints them at its end; or what is in the files TRAJECTORY...: scene, tasks and their steps,
    how it was generated.

    Several runs of one suite stand in one table. With `--per-sample` the samples are printed
    instead, for other programs: `infthor-eval show RUN --format parquet > samples.parquet`. With
    `--question ID` one sample is shown, and why its reply got its score.
    """
    options = ShowOptions.from_click(params)
    if question is not None:
        if per_sample or options != ShowOptions():
            raise UsageError("--question: is for one sample in words; leave out the other options")
        _print_question(paths, question)
    elif any(map(is_trajectory_file, paths)):
        if per_sample or options.full or options.format not in {None, "json"}:
            raise UsageError(
                "--per-sample, --format and --full: are for runs, not for trajectories"
            )
        _print_trajectories(paths, options)
    elif per_sample or options.format == "parquet":
        _print_samples(paths, options)
    else:
        _print_runs(paths, options)


def _print_runs(folders: Sequence[Path], options: ShowOptions) -> None:
    """Print the results of runs, and why units have none."""
    runs = [Run.open(folder, print_failure).read() for folder in folders]
    print_results(runs, options)
    for run in runs:
        print_failures(run.records, run.folder if len(runs) > 1 else None)


def _print_trajectories(paths: tuple[Path, ...], options: ShowOptions) -> None:
    import msgspec

    from infthor_eval.formats.trajectory import iter_trajectories
    from infthor_eval.generation.trajectory_table import summary_of, trajectory_table
    from infthor_eval.report.terminal import print_table, table_console

    runs = [path for path in paths if not is_trajectory_file(path)]
    if runs:
        raise UsageError(f"{runs[0]}: not a trajectory file; give runs in a call of their own")
    found = [summary_of(item) for path in paths for item in iter_trajectories(path)]
    if options.format == "json":
        click.echo(msgspec.json.format(msgspec.json.encode(found), indent=2))
        return
    output = table_console()
    for summary in found:
        print_table(trajectory_table(summary), output)


def _print_question(folders: tuple[Path, ...], name: str) -> None:
    from infthor_eval.report.sample import find_samples

    for sample in find_samples(open_runs(folders, print_failure), name):
        for line in sample.lines():
            print_line(line)


def _print_samples(folders: tuple[Path, ...], options: ShowOptions) -> None:
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
    table = sample_table(open_runs(folders, print_failure))
    sys.stdout.buffer.write(encode_samples(table, options.format))
