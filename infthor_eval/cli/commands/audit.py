"""`infthor-eval audit`: what a set of questions gives away."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH, SET
from infthor_eval.cli.progress.notes import print_failure, print_left_out, print_note
from infthor_eval.errors import DataError, UsageError

if TYPE_CHECKING:
    from infthor_eval.runs import RunSummary


@example_command("audit", "infthor-eval audit SET --balanced qa_set_balanced.csv")
@click.argument("set_folder", metavar="SET", type=SET)
@click.argument("runs", metavar="[RUN]...", nargs=-1, type=PATH)
@click.option(
    "--balanced",
    metavar="OUT.csv",
    type=PATH,
    help="Write the part in which guessing does not help.",
)
def command(set_folder: Path, runs: tuple[Path, ...], balanced: Path | None) -> None:
    """Print what can be guessed of a set's answers without a frame, and what runs got beside that.

    SET is a folder with question files, or one of them. It needs no frames. Guessers know the words
    of a question, number and place of its clue frames, and, where the set has the logs of frames,
    whether the hand was full and how much was in view. They learn from questions on other
    trajectories, and from those in other scenes alone.
    """
    from infthor_eval.formats.nieh_set import NiehSet
    from infthor_eval.formats.qa_csv import encode_questions, write_questions
    from infthor_eval.nieh.guessing.audit import audit
    from infthor_eval.nieh.guessing.audit_tables import (
        audit_tables,
        balanced_table,
        guessers_table,
        runs_table,
    )
    from infthor_eval.nieh.guessing.balancing import balance
    from infthor_eval.report.terminal import print_table, table_console
    from infthor_eval.storage.files import prepare_file, refuse_overwrite

    if balanced is not None:
        prepare_file(balanced, "--balanced")
    data = NiehSet(set_folder)
    print_left_out(data.root, data.skipped)
    if not data.questions:
        raise DataError(f"{set_folder}: no question can be audited; fix the set, or give another")
    summaries = [_read_summary(folder) for folder in runs]
    audited = audit(data)
    console = table_console()
    for table in (guessers_table(audited), *audit_tables(audited)):
        print_table(table, console)
    if summaries:
        print_table(runs_table(summaries), console)
    for sentence in audited.sentences():
        click.echo(f"- {sentence}")
    if balanced is not None:
        part = balance(data.questions)
        print_table(balanced_table(part), console)
        if not part.questions:
            raise UsageError(
                f"--balanced {balanced}: no form of this set has a balanced part; nothing is "
                "written"
            )
        refuse_overwrite(balanced, encode_questions(part.questions))
        write_questions(balanced, part.questions)
        print_note(f"{balanced}: {len(part.questions)} of {len(data.questions)} questions")


def _read_summary(folder: Path) -> "RunSummary":
    from infthor_eval.nieh.results.summary import NiehSummary
    from infthor_eval.run import Run

    run = Run.open(folder, print_failure).own_summary
    if not isinstance(run.summary, NiehSummary):
        raise UsageError(
            f"{folder}: a run of {run.header.suite}; only runs of nieh can stand beside blind"
        )
    return run
