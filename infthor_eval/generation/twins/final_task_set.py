"""Making the twins for agents of many trajectories; the same command resumes an interrupted run.

Each trajectory's draft is written when its worlds are, and is not made again.
"""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import msgspec

from infthor_eval.errors import InfthorError
from infthor_eval.formats.set_info import claim_for_simulator
from infthor_eval.generation.replay_set import Selection
from infthor_eval.generation.simulator_jobs import (
    SimulatorWorker,
    collect_outcomes,
)
from infthor_eval.generation.twins.draft_files import (
    DRAFTS,
    DraftOutcome,
    Item,
    count_edits,
    draft_item,
    failure_line,
)
from infthor_eval.generation.twins.drafting import TwinSettings
from infthor_eval.generation.twins.final_tasks import (
    TRAJECTORIES,
    FinalTaskDraft,
    draft_final_tasks,
)
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.workers import WorkerSettings, run_jobs


class FinalTaskSummary(msgspec.Struct):
    """Numbers of a set of twins for agents, as `--json` prints them.

    Attributes:
        trajectories: number of trajectories that twins were made of.
        resumed: number of these of earlier runs.
        proposed: number of proposed edits by kind.
        kept: number of those that became a pair, by kind.
        rejected: number of the others by reason.
        pairs: number of pairs.
        failures: trajectories that twins cannot be made of, one line each.
        seconds: wall time of this run.
    """

    trajectories: int
    resumed: int
    proposed: dict[str, int]
    kept: dict[str, int]
    rejected: dict[str, int]
    pairs: int
    failures: list[str]
    seconds: float


def make_final_tasks(
    selection: Selection,
    launch: Launch,
    out: Path,
    settings: TwinSettings,
    *,
    worker_settings: WorkerSettings,
    progress: Callable[[bool], None] = lambda _: None,
    say: Callable[[str], None] = lambda _: None,
) -> FinalTaskSummary:
    """Make twins with final tasks; arguments and errors are those of `twin_set.make_twins`."""
    started = time.monotonic()
    for name in (TRAJECTORIES, DRAFTS):
        (out / name).mkdir(parents=True, exist_ok=True)
    claim_for_simulator(out, launch.label)
    run_job = partial(_draft_one, out=out, settings=settings)
    start = partial(SimulatorWorker, partial(Simulator, launch), run_job)
    items = selection.items

    def failed(number: int, error: InfthorError) -> DraftOutcome[FinalTaskDraft]:
        return DraftOutcome[FinalTaskDraft](failure=failure_line(items[number], error))

    outcomes = collect_outcomes(run_jobs(start, items, worker_settings, say), failed, progress)
    failures = [failure.message for failure in selection.failures]
    failures += [outcome.failure for outcome in outcomes if outcome.failure]
    drafts = [outcome.draft for outcome in outcomes if outcome.draft is not None]
    proposed, kept, rejected = count_edits(drafts)
    return FinalTaskSummary(
        trajectories=len(drafts),
        resumed=sum(outcome.is_resumed for outcome in outcomes),
        proposed=proposed,
        kept=kept,
        rejected=rejected,
        pairs=sum(len(draft.worlds) for draft in drafts),
        failures=failures,
        seconds=round(time.monotonic() - started, 1),
    )


def _draft_one(
    item: Item, simulator: Simulator, out: Path, settings: TwinSettings
) -> DraftOutcome[FinalTaskDraft]:
    source, trajectory = item
    make = partial(draft_final_tasks, trajectory, source.digest, settings, simulator, out)
    return draft_item(item, out, settings, FinalTaskDraft, make)
