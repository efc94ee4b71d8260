"""`infthor-eval questions`, `moments` and `twins`: make questions, pairs of moments, or twins."""

from __future__ import annotations

from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import (
    PATH,
    SET,
    FiniteFloat,
    WholeNumber,
    default_option,
    floor_plans_option,
)
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options
from infthor_eval.cli.progress.bar import PacedBar
from infthor_eval.errors import UsageError
from infthor_eval.storage.files import hold_folder, prepare_file, refuse_overwrite, write_output
from infthor_eval.terminal import console, error_console, print_line, progress_bar

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rich.console import Console

    from infthor_eval.formats.question import Question
    from infthor_eval.generation.twins.drafting import TwinSettings
    from infthor_eval.generation.twins.twin_set import DraftTwins, FinalTaskSummary, TwinSummary
    from infthor_eval.thor.launch import Launch


@example_command("questions", "infthor-eval questions SET --out SET/qa_set_mine.csv")
@click.argument("folder", metavar="SET", type=SET)
@click.option("--out", required=True, type=PATH, help="CSV file to write.")
@default_option("--seed", WholeNumber(0), 0, "Seed of every choice.")
@default_option(
    "--per-trajectory", click.IntRange(1), 25, "Questions per trajectory and moment, at most."
)
@click.option(
    "--moments",
    type=click.IntRange(1),
    help="Ask at so many moments of each trajectory, evenly spaced. Default: at its end.",
)
@default_option(
    "--min-share",
    FiniteFloat(0, 1),
    default=0.001,
    help="Share of a frame's pixels that an object must fill to count as visible.",
)
@click.option(
    "--further",
    is_flag=True,
    help="Add question forms that are not in Table 3, with their own types.",
)
@default_option(
    "--words",
    click.Choice(["plain", "published"]),
    default="plain",
    help="Plain English, or the published files' words with type names, to extend the published "
    "set.",
)
@click.option("--overwrite", is_flag=True, help="Replace a file that holds other questions.")
@worker_options
def questions(
    folder: Path,
    out: Path,
    seed: int,
    per_trajectory: int,
    moments: int | None,
    min_share: float,
    further: bool,
    words: str,
    overwrite: bool,
    **workers: Any,
) -> int:
    """Generate questions on a replayed SET, in the words of the paper's Table 3.

    Exit code 1 if a trajectory of the set cannot be read.
    """
    from infthor_eval.generation.questions.generate import generate_questions

    worker_settings = parse_worker_settings(**workers)
    prepare_file(out)
    notes = error_console()
    with progress_bar(notes) as progress:
        result = generate_questions(
            folder,
            seed=seed,
            per_trajectory=per_trajectory,
            moments=moments or 0,
            share=min_share,
            further=further,
            published_words=words == "published",
            worker_settings=worker_settings,
            notify=notes.print,
            begin=lambda part, n: PacedBar(progress, part, n).advance,
        )
    _write(out, result.questions, overwrite)
    print_line(f"{len(result.questions)} questions on {result.trajectories} trajectories: {out}")
    print_line(result.summary_text())
    for question in result.unconfirmed:
        notes.print(f"skipped, the checker disagrees: {question.traj_id}: {question.text}")
    for line in result.skipped:
        notes.print(f"skipped: {line}", style="red")
    return int(bool(result.skipped))


@example_command("moments", "infthor-eval moments SET --out SET/moments.csv")
@click.argument("folder", metavar="SET", type=SET)
@click.option("--out", required=True, type=PATH, help="CSV file to write.")
@click.option(
    "--trajectories", type=PATH, help="Folder of the trajectories, if they are not in the set."
)
@default_option(
    "--per-trajectory", click.IntRange(2), 25, "Pairs of one trajectory, at most; they come by two."
)
@click.option(
    "--rungs",
    metavar="FRAMES,...",
    default="10,30,100,300",
    show_default=True,
    help="Ask so many frames after the evidence, at both moments.",
)
@click.option("--overwrite", is_flag=True, help="Replace a file that holds other questions.")
def moments(
    folder: Path,
    out: Path,
    trajectories: Path | None,
    per_trajectory: int,
    rungs: str,
    overwrite: bool,
) -> int:
    """Pair moments of a SET: the same question at two of them has two answers.

    No second world is needed, and which moment is the later one tells nothing. Exit code 1 if a
    trajectory of the set cannot be read.
    """

    from infthor_eval.generation.moment_pairs import pair_moments
    from infthor_eval.generation.questions.generate import trajectory_folders
    from infthor_eval.nieh.scoring import score

    ages = _parse_rungs(rungs)
    if not ages:
        raise UsageError("--rungs: give numbers of frames above 0, as in 10,30,100")
    prepare_file(out)
    notes = error_console()
    with progress_bar(notes) as progress:
        result = pair_moments(
            folder,
            ages,
            per_trajectory,
            partial(score, scorer="strict"),
            trajectories,
            PacedBar(progress, "moments paired", len(trajectory_folders(folder))).advance,
        )
    _write(out, result.questions, overwrite)
    output = console()
    n_pairs = result.by_form.total()
    output.print(f"{n_pairs} pairs of moments on {result.trajectories} trajectories: {out}")
    _print_counts("by form", result.by_form, output)
    _print_counts("by frames since the evidence", result.by_age, output)
    for line in result.skipped:
        notes.print(f"skipped: {line}", style="red")
    return int(bool(result.skipped))


def _write(out: Path, questions: Sequence[Question], overwrite: bool) -> None:
    """Write a question file, and refuse to replace one that holds other questions."""
    from infthor_eval.formats.qa_csv import encode_questions

    content = encode_questions(questions)
    if not overwrite:
        refuse_overwrite(out, content)
    with write_output(out, "give another --out") as partial:
        partial.write_bytes(content)


@example_command("twins", "infthor-eval twins trajectories --out TWINS")
@click.argument("trajectories", nargs=-1, required=True, type=PATH)
@click.option("--out", required=True, type=PATH, help="Folder of the set, new or to be continued.")
@click.option("--kinds", metavar="KIND,...", help="Kinds of edits, with commas; default: all.")
@default_option(
    "--per-trajectory", click.IntRange(1), 25, "Paired questions of one trajectory, at most."
)
@default_option(
    "--per-kind",
    click.IntRange(1),
    default=2,
    help="Twins of one kind and trajectory, at most; twice as many edits are tried.",
)
@click.option(
    "--rungs",
    metavar="FRAMES,...",
    help="Ask so many frames after the evidence, while both worlds look the same: 10,30,100,300; "
    "with placebo pairs. Default: at the end.",
)
@default_option("--seed", WholeNumber(0), 0, "Seed of every choice.")
@click.option("--limit", type=click.IntRange(1), help="Trajectories, at most.")
@click.option(
    "--unity", is_flag=True, help="Use AI2-THOR's own Unity build, not the embedded simulator."
)
@click.option(
    "--final-tasks",
    is_flag=True,
    help="Make twins for agents: trajectories with a final task, in place of questions.",
)
@click.option(
    "--arms",
    is_flag=True,
    help="Make twins for arms: two things stand before it, and what happened tells which is meant.",
)
@floor_plans_option
@worker_options
@click.option("--json", "as_json", is_flag=True, help="Print the summary as one JSON object.")
def twins(
    trajectories: tuple[Path, ...],
    out: Path,
    kinds: str | None,
    per_trajectory: int,
    per_kind: int,
    rungs: str | None,
    seed: int,
    limit: int | None,
    unity: bool,
    final_tasks: bool,
    arms: bool,
    data: Path | None,
    as_json: bool,
    **workers: Any,
) -> int:
    """Make twins of trajectories (.json, .jsonl, .jsonl.gz, directories, sets).

    A twin is the same episode in a world with one thing changed, so that a question in the same
    words has another answer. Writes an NIEH set with both worlds of each pair; trajectories that
    are done are not tried again. With --final-tasks, writes trajectories for the task
    infthor_twins; with --arms, a set for manipulathor_twins and nieh_twins. Exit code 1 if twins of
    a trajectory cannot be made at all.
    """

    from infthor_eval.generation.arm_twins.drafting import KIND as ARM_KIND
    from infthor_eval.generation.replay_set import select
    from infthor_eval.generation.twins.drafting import TwinSettings
    from infthor_eval.generation.twins.twin_set import make_final_tasks, make_twins
    from infthor_eval.thor import launch
    from infthor_eval.thor.supplement import supplement_file

    worker_settings = parse_worker_settings(**workers)
    if rungs and final_tasks:
        raise UsageError("--rungs is for questions; leave it out, or --final-tasks")
    if arms and (rungs or final_tasks or kinds or unity):
        raise UsageError("--arms: leave out --rungs, --final-tasks, --kinds and --unity")
    made = (ARM_KIND,) if arms else parse_kinds(kinds, final_tasks)
    settings = TwinSettings(made, seed, per_kind, _parse_rungs(rungs))
    notes = error_console()
    with ExitStack() as held:
        held.enter_context(hold_folder(out))
        selection = select(trajectories, limit)
        supplement = held.enter_context(
            supplement_file(trajectory for _, trajectory in selection.items)
        )
        progress = held.enter_context(progress_bar(notes))
        launched = launch.unity_launch() if unity else launch.embedded_launch(data, supplement)
        make: Callable[..., TwinSummary | FinalTaskSummary] = make_final_tasks
        if not final_tasks:
            draft = drafting_of(settings, launched)
            make = partial(make_twins, draft=draft, per_trajectory=per_trajectory)
        summary = make(
            selection,
            launched,
            out,
            settings,
            worker_settings=worker_settings,
            advance=PacedBar(progress, "twins", len(selection.items)).advance,
            notify=notes.print,
        )
    if as_json:
        import msgspec

        click.echo(msgspec.json.encode(summary))
    else:
        _print(summary, console())
    for line in summary.failures:
        notes.print(f"no twins: {line}", style="red")
    return int(bool(summary.failures))


def drafting_of(settings: TwinSettings, launched: Launch) -> DraftTwins:
    """Return what makes twins of a trajectory by these settings, in this simulator."""
    from infthor_eval.generation.arm_twins.drafting import KIND, draft_arm_twins
    from infthor_eval.generation.twins.drafting import draft_twins
    from infthor_eval.manipulation.reach import PlannerReach
    from infthor_eval.nieh.scoring import score

    if settings.kinds == (KIND,):
        return partial(draft_arm_twins, reaches=PlannerReach(launched))
    return partial(draft_twins, score=partial(score, scorer="strict"))


def parse_kinds(names: str | None, final_tasks: bool = False) -> tuple[str, ...]:
    """Return the names of kinds that an option gives; an unknown one is an error."""
    from infthor_eval.generation.twins.final_tasks import MOVING_KINDS
    from infthor_eval.generation.twins.kinds import KINDS, EditKind

    if names is None:
        return MOVING_KINDS if final_tasks else KINDS.names
    wanted = tuple(dict.fromkeys(name.strip() for name in names.split(",")))
    for name in wanted:
        KINDS.load(name, EditKind)
    return wanted


def _parse_rungs(text: str | None) -> tuple[int, ...]:
    """Return numbers of frames in order, each once; an entry that is none is an error."""
    entries = [entry.strip() for entry in text.split(",")] if text else []
    if not all(entry.isascii() and entry.isdigit() and int(entry) for entry in entries):
        raise UsageError(f"--rungs {text}: give numbers of frames above 0, as in 10,30,100")
    return tuple(sorted(set(map(int, entries))))


def _print(summary: TwinSummary | FinalTaskSummary, output: Console) -> None:
    from infthor_eval.generation.twins.twin_set import TwinSummary

    tables: list[tuple[str, Mapping[Any, int]]]
    if isinstance(summary, TwinSummary):
        found = f"{summary.pairs} paired questions of {summary.found} on {summary.facts} facts"
        if summary.by_age:
            found += f", {summary.placebos} placebos"
        tables = [
            ("by kind", summary.by_kind),
            ("by form", summary.by_form),
            ("by frames since the evidence", summary.by_age),
        ]
    else:
        found = f"{summary.pairs} pairs of final tasks"
        tables = [("by kind", summary.kept)]
    output.print(
        f"{summary.trajectories} trajectories ({summary.resumed} of earlier runs): "
        f"{sum(summary.kept.values())} of {sum(summary.proposed.values())} edits kept; "
        f"{found}, {summary.seconds} s"
    )
    for title, counts in (*tables, ("rejected", summary.rejected)):
        _print_counts(title, counts, output)


def _print_counts(title: str, counts: Mapping[Any, int], output: Console) -> None:
    if counts:
        output.print(f"{title}: {', '.join(f'{name} {count}' for name, count in counts.items())}")
