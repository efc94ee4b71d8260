"""`infthor-eval export` and `import-replies`: runs in others' formats, and what others made as
runs."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH, SET, output_option
from infthor_eval.cli.progress.notes import print_failure, print_left_out, print_note, print_refused
from infthor_eval.errors import UsageError
from infthor_eval.exports.registry import FORMATS

if TYPE_CHECKING:
    from infthor_eval.run import Run

_RELATIONSHIPS = ("first_party", "third_party", "collaborative", "other")


@example_command(
    "export", "infthor-eval export results/*/nieh_mini-* --format every-eval-ever --out exported"
)
@click.argument("runs", metavar="RUN...", nargs=-1, required=True, type=PATH)
@click.option(
    "--format", "file_format", type=click.Choice(FORMATS), required=True, help="The format."
)
@click.option("--out", type=PATH, required=True, help="Folder of the files.")
@click.option(
    "--data", type=SET, metavar="SET", help="Folder of the question set, if the runs name none."
)
@click.option(
    "--frames", is_flag=True, help="Write the frames of requests too, where there is a place."
)
@click.option(
    "--model-id",
    metavar="OWNER/NAME",
    help="The model as others know it. Default: its name on the hub, if the runs have it.",
)
@click.option("--organization", metavar="NAME", help="Who made the runs.")
@click.option(
    "--relationship",
    type=click.Choice(_RELATIONSHIPS),
    help="Theirs to the model's developer.  [default: other]",
)
@click.option(
    "--dataset", metavar="OWNER/NAME", help="The data set on the Hugging Face hub, if it is there."
)
@click.option("--source-url", metavar="URL", help="Where the runs, or a text on them, are.")
def export(runs: tuple[Path, ...], file_format: str, out: Path, **options: Any) -> None:
    """Write the runs in the folders RUN... in a format of others (docs/exports.md).

    What the format has no place for is named in a line, and what a run has not done, or failed at.
    Nothing is uploaded.
    """
    from infthor_eval.exports.registry import find_writer
    from infthor_eval.exports.request import ExportRequest
    from infthor_eval.exports.subjects import require_one_model
    from infthor_eval.run import open_runs
    from infthor_eval.storage.files import prepare_folder
    from infthor_eval.terminal import print_line

    for name in ("model_id", "dataset"):
        _check_hub_name(f"--{name.replace('_', '-')}", options[name])
    given = {name: value for name, value in options.items() if value}
    write = find_writer(file_format, given)
    found = open_runs(runs, print_failure)
    if "model_id" in given:
        require_one_model([run.own_header for run in found])
    written = write(found, ExportRequest(prepare_folder(out), **given))
    for note in written.notes:
        print_note(note, "yellow")
    print_note(f"{file_format} has no place for {written.no_place}")
    for path in written.paths:
        print_line(str(path))


def _check_hub_name(option: str, name: str | None) -> None:
    owner, _, rest = (name or "").partition("/")
    if name is not None and not (owner and rest):
        raise UsageError(f"{option} {name!r:.60}: is not OWNER/NAME; write both, as on the hub")


@example_command("import-replies", "infthor-eval import-replies LOG --data SET --out results")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=PATH)
@click.option(
    "--data", type=SET, metavar="SET", help="Folder of the NIEH set that the replies are about."
)
@click.option(
    "--model",
    metavar="NAME",
    help="Name of the model. Default: the one that the log names.",
)
@output_option
def import_replies(
    logs: tuple[Path, ...], data: Path | None, model: str | None, output: Path
) -> int:
    """Score replies to NIEH questions that others made, or counts of plans; store them as runs.

    LOG is a published log of replies or of plans, has the samples of lm-eval, Every Eval Ever or
    inspect_ai (docs/exports.md), or a JSON object a line with question_id and reply. SET needs no
    frames; logs of plans need no SET. Logs of one model in one mode become one run, which `show`,
    `compare` and `report` read like any other. A row that answers no question of SET is counted and
    named; the exit code is then 1.
    """
    from infthor_eval.cli.options.show import ShowOptions
    from infthor_eval.cli.results import print_results
    from infthor_eval.formats.plan_logs import is_plan_log

    plan_logs = [log for log in logs if is_plan_log(log)]
    reply_logs = [log for log in logs if log not in plan_logs]
    if reply_logs and data is None:
        raise UsageError(
            f"{reply_logs[0]}: has replies to questions; give their NIEH set with --data"
        )
    imported = [*_import_plans(plan_logs, model, output)]
    if data is not None:
        imported += _import_replies(reply_logs, data, model, output)
    print_results([results for results, _ in imported], ShowOptions())
    return 1 if any(n_refused for _, n_refused in imported) else 0


def _import_replies(
    logs: Sequence[Path], data: Path, model: str | None, output: Path
) -> Iterator[tuple["Run", int]]:
    """Yield the results of runs of logs of replies, and the number of rows not imported."""
    from infthor_eval.formats.nieh_set import NiehSet
    from infthor_eval.nieh.published.imported_replies import import_logs
    from infthor_eval.nieh.suite import NiehSuite
    from infthor_eval.run import Run
    from infthor_eval.runs.stored.writing import store_run

    questions = NiehSet(data)
    suite = NiehSuite()
    print_left_out(data, questions.malformed)
    for run in import_logs(logs, questions, model):
        stored = store_run(output, run.header(questions), suite, run.make_records, run.n_missing)
        name = f"{run.model}, {run.task}"
        counts = f"{run.n_missing} of {len(run.question_ids)} questions without one"
        print_note(f"{name}: {len(run.records)} replies imported, {counts}")
        if "prompt" in run.settings:
            unknown = (
                "unknown, as its counts of tokens fit no published prompt in tokens of Qwen2.5-VL"
            )
            print_note(f"{name}: the prompt it was asked with: {run.settings['prompt'] or unknown}")
        problems = {"not imported": run.refused, "scored otherwise than logged": run.rescored}
        for what, rows in problems.items():
            print_refused(name, what, [(row.log, row.line, row.reason) for row in rows])
        yield Run.just_stored(stored, suite), len(run.refused)


def _import_plans(
    logs: Sequence[Path], model: str | None, output: Path
) -> Iterator[tuple["Run", int]]:
    """Yield the results of runs of logs of plans, and the number of rows not imported."""
    from infthor_eval.formats.plan_logs import read_plan_log
    from infthor_eval.plans.published.imported_counts import import_counts
    from infthor_eval.plans.suite import PlansSuite
    from infthor_eval.run import Run
    from infthor_eval.runs.stored.writing import store_run

    suite = PlansSuite()
    for run in [import_counts(read_plan_log(log), model) for log in logs]:
        stored = store_run(output, run.header, suite, run.make_records, n_missing=0)
        name = run.header.name
        path = run.log.path
        n_trajectories = len({record.cluster for record in run.records})
        print_note(
            f"{name}: {len(run.records)} plans of {n_trajectories} trajectories imported; the "
            f"set-up of {run.n_failed_set_ups} more failed"
        )
        print_refused(name, "not imported", [(path, row.line, row.reason) for row in run.refused])
        yield Run.just_stored(stored, suite), len(run.refused)
