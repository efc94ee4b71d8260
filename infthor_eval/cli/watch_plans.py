"""What `infthor-eval watch` does with a run of plans."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from infthor_eval.cli.watching import Wanted, followed, heading, place_of, refuse_options

if TYPE_CHECKING:
    from infthor_eval.plans.replaying import Record, Recorded

__all__ = ["watch_plans"]


def watch_plans(wanted: Wanted) -> None:
    """Write the recording of a trajectory's plans."""
    from infthor_eval.cli.paced_bar import PacedBar
    from infthor_eval.formats.animations import write_animation
    from infthor_eval.formats.files import prepare_file
    from infthor_eval.plans.curve_runs import PlansRun
    from infthor_eval.plans.records import RECORDS
    from infthor_eval.plans.replaying import recorded_plans, replay
    from infthor_eval.report.recording import pictures
    from infthor_eval.runs import read_run
    from infthor_eval.terminal import error_console, print_line, progress_bar

    refuse_options(wanted, "plans", {"--episode": wanted.episode, "--sheet": wanted.sheet})
    header, records = read_run(wanted.run, RECORDS)
    recorded = recorded_plans(PlansRun(header.name, header, records), wanted.task, wanted.trajectory)
    chosen = _chosen(recorded, wanted.plans)
    label, parts = recorded.run.label, [recorded.task, recorded.trajectory]
    choice = [] if wanted.plans is None else [wanted.plans.strip()]
    path = prepare_file(wanted.out or place_of([label, *parts, *choice]))
    above = heading([label, *parts], recorded.run.about.simulator)
    notes = error_console()
    with replay(recorded, wanted.data, wanted.scenes) as stage, progress_bar(notes) as progress:
        bar = PacedBar(progress, recorded.trajectory, sum(len(plan.payload.steps) + 1 for plan in chosen))
        moments = followed(stage.moments(chosen), bar.advance, notes)
        n_pictures = write_animation(path, pictures(moments, above), wanted.fps)
    print_line(f"{len(chosen)} of {stage.n_plans} plans, {n_pictures / wanted.fps:.0f} s: {path}")


def _chosen(recorded: Recorded, plans: str | None) -> Sequence[Record]:
    from infthor_eval.errors import UsageError

    if plans is None:
        return recorded.plans
    found = re.fullmatch(r"(\d{1,9})(?:-(\d{1,9}))?", plans.strip())
    if found is None:
        raise UsageError(f"--plans {plans!r:.60}: is neither a plan's number nor two of them; write 7, or 3-7")
    return recorded.between(int(found[1]), int(found[2] or found[1]))
