"""`infthor-eval rescore`: today's scores of the replies in a run's journal, as a run of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import (
    PATH,
    ModelArgs,
    ModelList,
    ModelSpec,
    WholeNumber,
    default_option,
    output_option,
)
from infthor_eval.cli.progress.notes import NOTES, print_failure, print_note, prints_as_notes

if TYPE_CHECKING:
    from infthor_eval.nieh.records import NiehAnswer
    from infthor_eval.nieh.rescoring.judging import Judge
    from infthor_eval.nieh.rescoring.report import Change, RescoringReport
    from infthor_eval.nieh.rescoring.rescore import Rescored, Rescoring, Source
    from infthor_eval.run import Run
    from infthor_eval.runs import UnitRecord

# Most tokens of a verdict by prompt. Those are the names of
# `infthor_eval.nieh.rescoring.judge_prompts`, which is slow to import.
_JUDGE_TOKENS = {"yes-no": 16, "published": 64}
_JUDGE_PROMPT = "yes-no"


@example_command("rescore", "infthor-eval rescore results/blind/RUN --scorer my_scorer.py:measure")
@click.argument("folder", metavar="RUN", type=PATH)
@click.option(
    "--scorer",
    metavar="NAME",
    help="Your own scorer beside ours: FILE.py:NAME, or the name of a package's.",
)
@click.option(
    "--judge",
    type=ModelList(),
    metavar="MODEL",
    help="Ask this model where the rules are unsure (off by default; any model of `ls models`, "
    "usually openai).",
)
@click.option(
    "--judge-args", type=ModelArgs(), default="", metavar="K=V,...", help="Options of the judge."
)
@click.option(
    "--judge-prompt",
    type=click.Choice(tuple(_JUDGE_TOKENS)),
    help="How the judge is asked: for yes or no, the default, or for a score in the words of the "
    "published judge.",
)
@click.option(
    "--judge-tokens",
    type=WholeNumber(1),
    metavar="N",
    help="Most tokens of a verdict; default: 16, and 64 for a score. A model that reasons first "
    "needs more.",
)
@default_option("--seed", WholeNumber(), 0, "Seed of the sample that measures the judge.")
@click.option(
    "--key", type=PATH, metavar="KEY", help="Key of a private set, for a run on its public part."
)
@output_option
def command(
    folder: Path,
    scorer: str | None,
    judge: tuple[ModelSpec, ...] | None,
    judge_args: Mapping[str, str],
    judge_prompt: str | None,
    judge_tokens: int | None,
    seed: int,
    key: Path | None,
    output: Path,
) -> int:
    """Score the replies in the journal of RUN, a run of NIEH, with today's scorers, and store them
    as a run.

    Neither the set nor the model is needed. Replies that are not there stay failed. The exit code
    is 1 if your scorer fails on a reply, or the judge cannot be asked.
    """
    from infthor_eval.formats.replies.answer_key import read_key
    from infthor_eval.nieh.own_scorers import find_scorer
    from infthor_eval.nieh.rescoring.keyed import with_key
    from infthor_eval.nieh.rescoring.rescore import score_again
    from infthor_eval.run import Run

    if judge is None and judge_args:
        raise click.UsageError("--judge-args are options of a judge; give one with --judge")
    if judge is None and judge_prompt is not None:
        raise click.UsageError("--judge-prompt is how a judge is asked; give one with --judge")
    if judge is not None and len(judge) > 1:
        raise click.UsageError(f"--judge names {len(judge)} models; give one")
    source = read_source(Run.open(folder, print_failure))
    if key is not None:
        source = with_key(source, read_key(key))
    prompt = judge_prompt or _JUDGE_PROMPT
    settings = (judge_tokens or _JUDGE_TOKENS[prompt], seed, prompt)
    with _load_judge(judge[0], judge_args, *settings) if judge else nullcontext() as loaded:
        with prints_as_notes():
            own = find_scorer(scorer) if scorer is not None else None
            rescoring = score_again(source, own, loaded)
            rescored = _store(rescoring, output)
        _print(rescoring, rescored)
        n_failed = _print_failures(rescored)
    return int(n_failed > 0)


def read_source(run: Run) -> Source:
    """Read what is scored again of a run."""
    from infthor_eval.errors import UsageError
    from infthor_eval.nieh.rescoring.rescore import Source
    from infthor_eval.nieh.suite import NiehSuite

    if run.listed.suite != NiehSuite.name:
        raise UsageError(
            f"{run.folder}: is a run of {run.listed.suite}; give a run of {NiehSuite.name}, which "
            "has replies"
        )
    return Source(run.own_header, run.records, run.stored_requests)


def _load_judge(
    judge: ModelSpec, more: Mapping[str, str], max_new_tokens: int, seed: int, prompt: str
) -> AbstractContextManager[Judge]:
    from infthor_eval.nieh.rescoring.judging import Judge
    from model_adapters import model_note

    with prints_as_notes():
        loaded = Judge.load(judge.name, {**more, **judge.options}, max_new_tokens, seed, prompt)
    if note := model_note(judge.name):
        print_note(f"{judge.name}: {note}", "yellow")
    return closing(loaded)


def _store(rescoring: Rescoring, output: Path) -> Rescored:
    from infthor_eval.cli.progress.bar import PacedBar
    from infthor_eval.terminal import progress_bar

    with progress_bar(NOTES) as progress:

        def track(records: Sequence[UnitRecord[NiehAnswer]]) -> Iterator[UnitRecord[NiehAnswer]]:
            bar = PacedBar(progress, "verdicts", len(records))
            for record in records:
                yield record
                bar.advance()

        return rescoring.store(output, track)


def _print(rescoring: Rescoring, rescored: Rescored) -> None:
    from infthor_eval.cli.options.show import ShowOptions
    from infthor_eval.cli.results import print_results
    from infthor_eval.nieh.rescoring.report import agreement_table, change_table, sources_of
    from infthor_eval.nieh.suite import NiehSuite
    from infthor_eval.report.terminal import print_table, table_console
    from infthor_eval.run import Run

    report = rescored.report
    console = table_console()
    _print_counts(report)
    print_table(change_table(report, sources_of(rescoring.header.config)), console)
    if report.judge is not None and rescoring.judge is not None:
        print_table(agreement_table(report.judge, rescoring.judge.name), console)
    print_results([Run.just_stored(rescored.run, NiehSuite())], ShowOptions())


def _print_counts(report: RescoringReport) -> None:
    counts = (
        (report.n_failed, "failed by the scorer"),
        (report.n_without_reply, "without a reply stay failed"),
        (report.n_missing, "were never asked"),
    )
    others = [f"{n} {what}" for n, what in counts if n]
    print_note("; ".join([f"{report.n_scored} replies scored", *others]))
    for task, names in report.left_out.items():
        print_note(
            f"{task}: {', '.join(names)}: left out, as the journal does not say how to compute it",
            "yellow",
        )
    for task, changes in report.tasks.items():
        for name, change in changes.items():
            if change.n_differ:
                _print_change(f"{task}, {name}", change)


def _print_change(name: str, change: Change) -> None:
    print_note(
        f"{name}: {change.n_differ} of {change.n_before} scores differ from those in the journal"
    )
    for item in change.examples:
        print_note(f"  {item.question}: {item.before:g}, now {item.now:g}: {item.reply!r:.60}")
    if change.n_differ > len(change.examples):
        print_note(f"  and {change.n_differ - len(change.examples)} more")


def _print_failures(rescored: Rescored) -> int:
    """Print why replies could not be scored or judged; return the number of these."""
    from infthor_eval.cli.results import print_failures
    from infthor_eval.reasons import count_reasons

    n_failed = print_failures(r for r in rescored.records if r.payload.reply is not None)
    unasked = rescored.judgement.failures if rescored.judgement else ()
    for name, reason, n in count_reasons(("judge", reason) for reason in unasked):
        print_failure(f"{name}: not asked about {n} replies, whose strict score stands: {reason}")
    return n_failed + len(unasked)
