"""`infthor-eval import-replies`: replies that others made, as runs."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.values import PATH

if TYPE_CHECKING:
    from infthor_eval.nieh.imported_replies import ImportedRun

__all__ = ["command"]

_SHOWN = 3  # rows that are named for each reason


@click.command(
    "import-replies", cls=ExampleCommand, example="infthor-eval import-replies LOG --data SET --output results"
)
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=PATH)
@click.option("--data", type=PATH, required=True, metavar="SET", help="Folder of the NIEH set that the logs are about.")
@click.option("--model", metavar="NAME", help="Name of the model. Default: the one in the names of published logs.")
@click.option("--output", type=PATH, default=Path("results"), show_default=True, help="Folder of the runs.")
def command(logs: tuple[Path, ...], data: Path, model: str | None, output: Path) -> int:
    """Score replies to NIEH questions that others made, and store them as runs.

    LOG is a published log, lm-eval's samples, or has a JSON object a line with question_id and reply. SET needs no
    frames. Logs of one model in one mode become one run, which `show`, `compare` and `report` read like any other. A
    row that answers no question of SET is counted and named; the exit code is then 1.
    """
    from infthor_eval.cli.options.show import ShowOptions
    from infthor_eval.cli.results import RunResults, print_results
    from infthor_eval.formats.nieh_set import NiehSet
    from infthor_eval.nieh.imported_replies import import_logs
    from infthor_eval.nieh.suite import NiehSuite
    from infthor_eval.runs.stored_run import store_run

    questions, suite = NiehSet(data), NiehSuite()
    results, n_refused = [], 0
    for run in import_logs(logs, questions, model):
        stored = store_run(output, run.header(questions), suite, run.make_records, run.n_missing)
        _print_counts(run)
        results.append(RunResults(stored.folder, suite, stored.summary, stored.usage, run.n_missing))
        n_refused += len(run.refused)
    print_results(results, ShowOptions())
    return 1 if n_refused else 0


def _print_counts(run: "ImportedRun") -> None:
    from infthor_eval.cli.progress.notes import print_note

    name = f"{run.model}, {run.task}"
    counts = f"{run.n_missing} of {len(run.question_ids)} questions without one"
    print_note(f"{name}: {len(run.records)} replies imported, {counts}")
    for kind, items in (("not imported", run.refused), ("scored otherwise than logged", run.rescored)):
        if items:
            print_note(f"{name}: {len(items)} row(s) {kind}")
        for item in items[:_SHOWN]:
            print_note(f"  {item.log.name}, line {item.line}: {item.reason}")
        if len(items) > _SHOWN:
            print_note(f"  and {len(items) - _SHOWN} more in {len({item.log for item in items})} log(s)")
