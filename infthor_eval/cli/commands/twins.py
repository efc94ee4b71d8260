"""`infthor-eval twins`: make twins of trajectories, whose questions have two answers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.values import PATH, WholeNumber
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options

if TYPE_CHECKING:
    from rich.console import Console

    from infthor_eval.generation.twins.twin_set import TwinSummary

__all__ = ["command"]


@click.command("twins", cls=ExampleCommand, example="infthor-eval twins trajectories --out TWINS")
@click.argument("trajectories", nargs=-1, required=True, type=PATH)
@click.option("--out", required=True, type=PATH, help="Folder of the set, new or to be continued.")
@click.option("--kinds", help="Kinds of edits, with commas; default: all.")
@click.option(
    "--per-trajectory",
    type=click.IntRange(1),
    default=25,
    show_default=True,
    help="Paired questions of one trajectory, at most.",
)
@click.option(
    "--per-kind",
    type=click.IntRange(1),
    default=2,
    show_default=True,
    help="Twins of one kind and trajectory, at most; twice as many edits are tried.",
)
@click.option(
    "--seed", type=WholeNumber(0), default=0, show_default=True, help="Seed of every choice."
)
@click.option("--limit", type=click.IntRange(1), help="Trajectories, at most.")
@worker_options
@click.option("--json", "as_json", is_flag=True, help="Print the summary as one JSON object.")
@click.pass_context
def command(
    context: click.Context,
    trajectories: tuple[Path, ...],
    out: Path,
    kinds: str | None,
    per_trajectory: int,
    per_kind: int,
    seed: int,
    limit: int | None,
    as_json: bool,
    **workers: Any,
) -> None:
    """Make twins of trajectories (.json, .jsonl, .jsonl.gz, directories, sets).

    A twin is the same episode in a world with one thing changed, so that a question in the same
    words has another answer. Writes an NIEH set with both worlds of each pair; trajectories that
    are done are not tried again. Exit code 1 if twins of a trajectory cannot be made at all.
    """
    from functools import partial

    from infthor_eval.cli.progress.bar import PacedBar
    from infthor_eval.generation.replay_set import select
    from infthor_eval.generation.twins.drafting import TwinSettings
    from infthor_eval.generation.twins.twin_set import make_twins
    from infthor_eval.nieh.scoring import score
    from infthor_eval.storage.files import prepare_folder
    from infthor_eval.terminal import console, error_console, progress_bar
    from infthor_eval.thor.launch import embedded_launch
    from infthor_eval.thor.supplement import supplement_file

    worker_settings = parse_worker_settings(**workers)
    settings = TwinSettings(_parse_kinds(kinds), seed, per_kind)
    notes = error_console()
    prepare_folder(out)
    selection = select(trajectories, limit)
    with (
        supplement_file(trajectory for _, trajectory in selection.items) as supplement,
        progress_bar(notes) as progress,
    ):
        summary = make_twins(
            selection,
            embedded_launch(None, supplement),
            out,
            settings,
            partial(score, scorer="strict"),
            per_trajectory=per_trajectory,
            worker_settings=worker_settings,
            progress=PacedBar(progress, "twins", len(selection.items)).advance,
            say=notes.print,
        )
    if as_json:
        import msgspec

        click.echo(msgspec.json.encode(summary))
    else:
        _print(summary, console())
    for line in summary.failures:
        notes.print(f"no twins: {line}", style="red")
    context.exit(1 if summary.failures else 0)


def _parse_kinds(names: str | None) -> tuple[str, ...]:
    """Return the names of kinds that an option gives; an unknown one is an error."""
    from infthor_eval.generation.twins.kinds import KINDS, EditKind

    if names is None:
        return KINDS.names
    wanted = tuple(dict.fromkeys(name.strip() for name in names.split(",")))
    for name in wanted:
        KINDS.load(name, EditKind)
    return wanted


def _print(summary: TwinSummary, output: Console) -> None:
    output.print(
        f"{summary.trajectories} trajectories ({summary.resumed} of earlier runs): "
        f"{sum(summary.kept.values())} of {sum(summary.proposed.values())} edits kept; "
        f"{summary.pairs} paired questions of {summary.found} on {summary.facts} facts, "
        f"{summary.seconds} s"
    )
    for title, counts in (
        ("by kind", summary.by_kind),
        ("by form", summary.by_form),
        ("rejected", summary.rejected),
    ):
        output.print(f"{title}: {', '.join(f'{name} {count}' for name, count in counts.items())}")
