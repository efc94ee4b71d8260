"""`infthor-eval validate`: keep the questions of a set that one of several models can answer."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import click
from msgspec.structs import replace

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.run import RunOptions
from infthor_eval.cli.options.values import (
    PATH,
    SET,
    ModelList,
    ModelSpec,
    WholeNumber,
    default_option,
)
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options
from infthor_eval.cli.progress.notes import print_note, prints_as_notes
from infthor_eval.cli.progress.runs import execute_runs
from infthor_eval.errors import UsageError
from infthor_eval.nieh.results.tables import clues_table
from infthor_eval.nieh.samples import find_set
from infthor_eval.nieh.scoring import Scorer
from infthor_eval.nieh.validation import (
    Verdicts,
    check_decisions,
    check_output,
    judge_questions,
    read_decisions,
    write_validated_set,
)
from infthor_eval.report.inspection import write_inspection_page
from infthor_eval.report.terminal import print_table, table_console
from infthor_eval.run import Run, with_distinct_names
from infthor_eval.runs import RunOutcome, RunRequest, RunSummary, Suite, prepare_all


@example_command("validate", "infthor-eval validate SET --model A,B,C,D --out VALIDATED")
@click.argument("set_folder", metavar="SET", type=SET)
@click.option(
    "--model",
    "--models",
    "models",
    type=ModelList(),
    required=True,
    metavar="MODEL,...",
    help="Model names with commas; the paper uses four. MODEL:K=V,... gives a model its own "
    "options.",
)
@click.option("--out", type=PATH, required=True, help="Folder of the validated set.")
@click.option("--decisions", type=PATH, help="inspection.csv with keep or drop filled in.")
@click.option("--scorer", type=click.Choice(["strict", "reference"]), help="[default: strict]")
@click.option(
    "--published",
    is_flag=True,
    help="Keep what a model answers in part, by the reference scorer, as the published filter did.",
)
@default_option("--seed", WholeNumber(), 0, "Seed of everything random.")
@worker_options
def command(
    set_folder: Path,
    models: tuple[ModelSpec, ...],
    out: Path,
    decisions: Path | None,
    scorer: Literal["strict", "reference"] | None,
    published: bool,
    seed: int,
    **workers: Any,
) -> int:
    """Ask each model every question of SET with its clue frames alone; keep what one answers.

    Rejected questions are written to rejected.jsonl with every reply. Questions with several clues
    that no model answers are written to inspection.csv and inspection.html: decide on them, and
    pass the file as --decisions. If the command is stopped, run it again to continue.
    """
    if published and scorer == "strict":
        raise UsageError("--published has the reference scorer; leave out --scorer strict")
    options = RunOptions(
        models=models,
        tasks=("nieh_gt",),
        data=set_folder,
        output=out / "runs",
        seed=seed,
        worker_settings=parse_worker_settings(**workers),
    )
    chosen: Scorer = scorer or ("reference" if published else "strict")
    return validate(options.requests(), out, decisions, chosen, partial_credit=published)


def validate(
    requests: Sequence[tuple[RunRequest, Suite]],
    out: Path,
    decisions_file: Path | None,
    scorer: Scorer,
    *,
    partial_credit: bool = False,
) -> int:
    """Run the models, judge the questions, write the validated set, and print Table 4 on it.

    Args:
        requests: one run for each model, all with the clue frames of the same set.
        out: folder of the validated set, with the runs in it.
        decisions_file: inspection list with decisions; None for none.
        scorer: scorer that decides whether an answer is correct.
        partial_credit: whether an answer that is right in part is correct.

    Returns:
        Exit code: 130 if a run was stopped, 1 if a model failed on a question, else 0.
    """
    decisions = read_decisions(decisions_file) if decisions_file else {}
    data = find_set(str(requests[0][0].tasks.data))
    check_decisions(decisions, data.questions)
    check_output(out, data)
    with prints_as_notes():
        runs = prepare_all(requests)
    outcomes, is_stopped = execute_runs(runs)
    if is_stopped:
        return 130
    answered = {record.id for record in outcomes[0].records}
    questions = [question for question in data.questions if question.id in answered]
    by_model = dict(zip(_model_names(outcomes), map(_replies, outcomes), strict=True))
    verdicts = judge_questions(
        questions, by_model, decisions, scorer, partial_credit=partial_credit
    )
    earlier = write_validated_set(out, data, verdicts)
    if earlier is not None:
        print_note(
            f"{earlier}: the earlier list; it has decisions on questions that need no inspection "
            "now"
        )
    write_inspection_page(out / "inspection.html", verdicts.to_inspect, data)
    console = table_console()
    print_table(clues_table([_summarise_kept(outcome, verdicts) for outcome in outcomes]), console)
    console.print(
        f"{len(questions)} questions: {len(verdicts.kept)} kept, {len(verdicts.rejected)} "
        f"rejected, {len(verdicts.to_inspect)} to inspect: {out}"
    )
    records = [record for outcome in outcomes for record in outcome.records]
    return int(any(record.failure is not None for record in records))


def _replies(outcome: RunOutcome) -> dict[str, Any]:
    """Return the replies of a run by question."""
    return {record.id: record.payload.reply for record in outcome.records}


def _model_names(outcomes: Sequence[RunOutcome]) -> list[str]:
    """The names of the models; labels where one is there with several options."""
    models = [outcome.run.request.model for outcome in outcomes]
    runs = with_distinct_names([Run(one.folder, one.summary.header) for one in outcomes])
    return [
        run.name if models.count(model) > 1 else model
        for model, run in zip(models, runs, strict=True)
    ]


def _summarise_kept(outcome: RunOutcome, verdicts: Verdicts) -> RunSummary:
    """The run's summary on the questions that are kept."""
    kept = {verdict.question.id for verdict in verdicts.kept}
    records = [record for record in outcome.records if record.id in kept]
    header = outcome.summary.header
    n_kept = Counter(record.task for record in records)
    tasks = {
        name: replace(task, n_samples=n_kept[name]) for name, task in header.config.tasks.items()
    }
    config = replace(header.config, tasks=tasks)
    header = replace(header, config=config, n_units=len(records), units_by_task=dict(n_kept))
    return RunSummary.of(outcome.run.suite, header, records)
