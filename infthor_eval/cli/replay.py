"""`infthor-eval replay`: run recorded trajectories in a simulator and write frames and logs."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rich.console import Console

    from infthor_eval.generation.replay_set import Selection, Summary
    from infthor_eval.thor.launch import Launch

from infthor_eval.cli.options import floor_plans_option

__all__ = ["command"]

_PATH = click.Path(path_type=Path)
_SHOWN = 20  # failures and divergences printed one by one; all are in the JSON summary


@click.command("replay")
@click.argument("trajectories", nargs=-1, required=True, type=_PATH)
@click.option("--out", required=True, type=_PATH, help="The set to write or to continue.")
@floor_plans_option
@click.option("--limit", type=click.IntRange(1), help="Replay at most this many trajectories.")
@click.option("--per-floor-plan", type=click.IntRange(1), help="At most this many of one floor plan.")
@click.option("--frames", type=click.IntRange(1), default=1, show_default=True, help="Frames per move or turn.")
@click.option("--unity", is_flag=True, help="Use AI2-THOR's own Unity build, not the embedded simulator.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as one JSON object.")
@click.pass_context
def command(
    context: click.Context,
    trajectories: tuple[Path, ...],
    out: Path,
    data: Path | None,
    limit: int | None,
    per_floor_plan: int | None,
    frames: int,
    unity: bool,
    as_json: bool,
) -> None:
    """Replay trajectories (.json, .jsonl, .jsonl.gz, directories) into an NIEH set.

    Writes one frame per low-level action (and the first one), the log of every frame, and the trajectory
    itself. Trajectories that the set has already are not replayed again. A refused action is reported and the
    replay goes on. Exit status 1 where a trajectory could not be replayed at all.
    """
    from rich.console import Console

    from infthor_eval.generation.replay_set import select
    from infthor_eval.thor import launch

    def start(supplement: Path) -> Launch:
        return launch.unity() if unity else launch.embedded(data, supplement)

    notes = Console(stderr=True, soft_wrap=True)
    selection = select(trajectories, limit, per_floor_plan)
    summary = _replay(selection, out, start, frames, notes)
    if as_json:
        import msgspec

        click.echo(msgspec.json.encode(summary.document()))
    else:
        _print(summary, Console(soft_wrap=True))
    for failure in summary.failures[:_SHOWN]:
        notes.print(f"not replayed: {failure.place}: {failure.message}", style="red", highlight=False, markup=False)
    context.exit(1 if summary.failures else 0)


def _replay(selection: Selection, out: Path, start: Callable[[Path], Launch], frames: int, notes: Console) -> Summary:
    from rich.progress import Progress

    from infthor_eval.generation.replay_set import replay_set
    from infthor_eval.generation.supplement import write_supplement
    from infthor_eval.thor.simulator import Simulator

    with tempfile.TemporaryDirectory(prefix="infthor-") as folder:
        supplement = Path(folder) / "supplement.json"
        write_supplement((trajectory for _, trajectory in selection.items), supplement)
        with Simulator(start(supplement)) as simulator, Progress(console=notes, transient=True) as progress:
            bar = progress.add_task("replay", total=len(selection.items))
            return replay_set(selection, simulator, out, lambda: progress.advance(bar), frames)


def _print(summary: Summary, output: Console) -> None:
    from rich import box
    from rich.table import Table

    document = summary.document()
    output.print(
        f"{document['trajectories']} trajectories on {document['floor_plans']} floor plans "
        f"({document['resumed']} replayed earlier, {document['failed']} failed), {document['whole']} whole, "
        f"{document['seconds']} s",
        highlight=False,
    )
    actions = Table("action", "accepted", "refused", "share", box=box.SIMPLE_HEAD)
    for name, counts in document["actions"].items():
        share = counts["accepted"] / (counts["accepted"] + counts["refused"])
        actions.add_row(name, str(counts["accepted"]), str(counts["refused"]), f"{share:.1%}")
    output.print(actions)
    if document["iou"]:
        overlaps = Table("action, object type", "boxes", "median IoU", "mean IoU", box=box.SIMPLE_HEAD)
        for kind, values in {**document["iou_by_action"], **document["iou"]}.items():
            overlaps.add_row(kind, str(values["count"]), f"{values['median']:.2f}", f"{values['mean']:.2f}")
        output.print(overlaps)
    for item in document["diverged"][:_SHOWN]:
        line = f"diverged: {item['traj_id']}: step {item['step']}: {item['action']}: {item['error']}"
        output.print(line, highlight=False, markup=False)
    hidden = len(document["diverged"]) - _SHOWN
    if hidden > 0:
        output.print(f"and {hidden} more; --json lists all", highlight=False)
