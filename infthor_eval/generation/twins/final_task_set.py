"""Making the twins for agents of many trajectories; the same command resumes an interrupted run.

Each trajectory's draft is written when its worlds are, and is not made again.
"""

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec

from infthor_eval.errors import DataError, InfthorError
from infthor_eval.formats.reading import read_json
from infthor_eval.formats.set_info import claim_for_simulator
from infthor_eval.formats.trajectory import Trajectory, TrajectorySource, folder_name
from infthor_eval.generation.replay_set import Selection, wrap_malformed
from infthor_eval.generation.simulator_jobs import (
    SimulatorWorker,
    collect_outcomes,
    freeze_existing_objects,
)
from infthor_eval.generation.twins.drafting import TwinSettings
from infthor_eval.generation.twins.final_tasks import (
    TRAJECTORIES,
    FinalTaskDraft,
    draft_final_tasks,
)
from infthor_eval.storage.files import write_atomically
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.workers import WorkerSettings, run_jobs

__all__ = ["FinalTaskSummary", "make_final_tasks"]

_DRAFTS = "drafts"
_HINT = "remove it, or choose another --out"
_Item = tuple[TrajectorySource, Trajectory]


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


@dataclass(frozen=True)
class _Outcome:
    """The outcome of one trajectory: its draft, or why there is none."""

    draft: FinalTaskDraft | None = None
    is_resumed: bool = False
    failure: str = ""


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
    for name in (TRAJECTORIES, _DRAFTS):
        (out / name).mkdir(parents=True, exist_ok=True)
    claim_for_simulator(out, launch.label)
    run_job = partial(_draft_one, out=out, settings=settings)
    start = partial(SimulatorWorker, partial(Simulator, launch), run_job)
    items = selection.items

    def failed(number: int, error: InfthorError) -> _Outcome:
        return _Outcome(failure=_line(items[number], error))

    outcomes = collect_outcomes(run_jobs(start, items, worker_settings, say), failed, progress)
    failures = [failure.message for failure in selection.failures]
    failures += [outcome.failure for outcome in outcomes if outcome.failure]
    drafts = [outcome.draft for outcome in outcomes if outcome.draft is not None]
    proposed = Counter[str]()
    rejected = Counter[str]()
    kept = Counter[str]()
    for draft in drafts:
        proposed.update(draft.proposed)
        kept.update(draft.proposed)
        for kind, reasons in draft.rejected.items():
            rejected.update(reasons)
            kept[kind] -= sum(reasons.values())
    return FinalTaskSummary(
        trajectories=len(drafts),
        resumed=sum(outcome.is_resumed for outcome in outcomes),
        proposed=dict(sorted(proposed.items())),
        kept=dict(sorted(kept.items())),
        rejected=dict(rejected.most_common()),
        pairs=sum(len(draft.worlds) for draft in drafts),
        failures=failures,
        seconds=round(time.monotonic() - started, 1),
    )


def _draft_one(item: _Item, simulator: Simulator, out: Path, settings: TwinSettings) -> _Outcome:
    source, trajectory = item
    # Not `.json`, so that the set may be read as a folder of trajectories.
    file = out / _DRAFTS / f"{folder_name(trajectory.traj_id)}.draft"
    try:
        if file.exists():
            return _Outcome(_read_draft(file, source.digest, settings), is_resumed=True)
        with freeze_existing_objects(), wrap_malformed():
            draft = draft_final_tasks(trajectory, source.digest, settings, simulator, out)
        with write_atomically(file) as partial_file:
            partial_file.write_bytes(msgspec.json.encode(draft) + b"\n")
    except InfthorError as error:
        return _Outcome(failure=_line(item, error))
    return _Outcome(draft)


def _read_draft(file: Path, base: str, settings: TwinSettings) -> FinalTaskDraft:
    """Return the draft of an earlier run, if it is of the same trajectory and settings."""
    draft = read_json(file, _HINT, FinalTaskDraft)
    if draft.digest != base:
        raise DataError(f"{file}: made of another trajectory of this name; {_HINT}")
    if draft.settings != settings:
        raise DataError(f"{file}: made with other kinds, seed or --per-kind; {_HINT}")
    return draft


def _line(item: _Item, error: InfthorError) -> str:
    source, trajectory = item
    return f"{source.place}: {trajectory.traj_id}: {error}"
