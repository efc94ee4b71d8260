"""`infthor-eval explain`: why two runs of the same questions differ."""

from pathlib import Path

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH


@example_command("explain", "infthor-eval explain results/A/RUN results/B/RUN")
@click.argument("first", metavar="A", type=PATH)
@click.argument("second", metavar="B", type=PATH)
@click.option("--all", "every", is_flag=True, help="Show every question that differs, not a few.")
def command(first: Path, second: Path, every: bool) -> int:
    """Print why the runs in the folders A and B differ, on the same questions.

    Exit code 0 if their replies and scores are equal, 3 if they differ by near ties alone, which
    rounding can exchange, 1 if they differ otherwise.
    """
    from infthor_eval.cli.progress.notes import print_failure
    from infthor_eval.errors import UsageError
    from infthor_eval.report.explanation import explain_runs
    from infthor_eval.report.terminal import print_table, table_console
    from infthor_eval.run import open_runs
    from infthor_eval.terminal import print_line

    runs = open_runs((first, second), print_failure, twice=True)
    if runs[0].suite.name != runs[1].suite.name:
        raise UsageError(
            f"{first} is a run of {runs[0].suite.name}, {second} of {runs[1].suite.name}; give "
            "runs of one suite"
        )
    explanation = explain_runs(*runs)
    for sentence in explanation.sentences():
        print_line(sentence)
    console = table_console()
    if explanation.findings:
        print_table(explanation.settings_table(), console)
    if not explanation.are_equal:
        print_table(explanation.questions_table(every=every), console)
    return 0 if explanation.are_equal else 3 if explanation.are_near_ties else 1
