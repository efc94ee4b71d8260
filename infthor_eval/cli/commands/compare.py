"""`infthor-eval compare`: runs on the same data, or on the questions that they share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH

if TYPE_CHECKING:
    from infthor_eval.run import Run


@example_command("compare", "infthor-eval compare results/oracle/RUN results/blind/RUN")
@click.argument("folders", metavar="RUN...", nargs=-1, required=True, type=PATH)
@click.option(
    "--same-questions",
    is_flag=True,
    help="Compare across tasks, contexts and depths, on the questions that they share; of one run, "
    "its own tasks and depths.",
)
@click.option(
    "--against",
    type=PATH,
    metavar="RUN",
    help="Compare all others with this run; else each with each before it.",
)
def command(folders: tuple[Path, ...], same_questions: bool, against: Path | None) -> None:
    """Print by how much each of the runs in the folders RUN... is better than those before it.

    Units with a result in both are paired; intervals and p values are clustered by trajectory.
    """
    from infthor_eval.cli.progress.notes import print_failure
    from infthor_eval.errors import UsageError
    from infthor_eval.run import open_runs

    if against is not None and against.resolve() not in {folder.resolve() for folder in folders}:
        folders = (against, *folders)
    if len(folders) < 2 and not same_questions:
        raise UsageError(
            f"{folders[0]}: one run; give another, or --same-questions to compare its tasks"
        )
    runs = open_runs(folders, print_failure, twice=True)
    other = next((run for run in runs if run.suite.name != runs[0].suite.name), None)
    if other is not None:
        raise UsageError(
            f"{runs[0].folder} is a run of {runs[0].suite.name}, {other.folder} of "
            f"{other.suite.name}; compare runs of one suite"
        )
    base = (
        None if against is None else [run.folder.resolve() for run in runs].index(against.resolve())
    )
    if same_questions:
        _print_same_questions(runs, base)
    else:
        _print_pairs(runs, base)


def _print_pairs(runs: Sequence[Run], base: int | None) -> None:
    from infthor_eval.report.comparison import compare, comparison_table
    from infthor_eval.report.terminal import print_table, table_console

    console = table_console()
    for first, second in _pairs(runs, base):
        rows = compare(first.suite, first.presenter, first.records, second.records)
        print_table(comparison_table(rows, first.label, second.label), console)


def _pairs(runs: Sequence[Run], base: int | None) -> Iterator[tuple[Run, Run]]:
    if base is None:
        yield from combinations(runs, 2)
    else:
        yield from ((runs[base], run) for number, run in enumerate(runs) if number != base)


def _print_same_questions(runs: Sequence[Run], base: int | None) -> None:
    from infthor_eval.report.same_questions import compare_sides, find_sides, sides_table
    from infthor_eval.report.terminal import print_table, table_console

    compared = compare_sides(runs, find_sides(runs), base)
    print_table(sides_table(compared), table_console())
