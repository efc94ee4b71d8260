"""Drafts of the twins of one trajectory each, written when they are whole and not made again."""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from infthor_eval.errors import DataError, InfthorError
from infthor_eval.formats.reading import read_json
from infthor_eval.formats.trajectory import Trajectory, TrajectorySource
from infthor_eval.generation.replay_set import wrap_malformed
from infthor_eval.generation.simulator_jobs import freeze_existing_objects
from infthor_eval.generation.twins.drafting import TwinDraft, TwinSettings
from infthor_eval.generation.twins.final_tasks import FinalTaskDraft
from infthor_eval.storage.files import file_name, is_written, write_atomically

DRAFTS = "drafts"  # folder in that of the set
_HINT = "remove it, or choose another --out"

Item = tuple[TrajectorySource, Trajectory]
Draft = TypeVar("Draft", TwinDraft, FinalTaskDraft)


@dataclass(frozen=True)
class DraftOutcome(Generic[Draft]):
    """The outcome of one trajectory: its draft, or why there is none."""

    draft: Draft | None = None
    is_resumed: bool = False
    failure: str = ""


def draft_item(
    item: Item, out: Path, settings: TwinSettings, form: type[Draft], make: Callable[[], Draft]
) -> DraftOutcome[Draft]:
    """Return the draft of a trajectory: of an earlier run if it is the same, else made and written.

    Args:
        item: the trajectory.
        out: folder of the set.
        settings: how twins are made.
        form: type of the draft.
        make: makes it.
    """
    source, trajectory = item
    # Not `.json`, so that the set may be read as a folder of trajectories.
    file = out / DRAFTS / f"{file_name(trajectory.traj_id)}.draft"
    try:
        if is_written(file):
            return DraftOutcome(_read(file, source.digest, settings, form), is_resumed=True)
        with freeze_existing_objects(), wrap_malformed():
            draft = make()
        with write_atomically(file) as partial_file:
            partial_file.write_bytes(msgspec.json.encode(draft) + b"\n")
    except InfthorError as error:
        return DraftOutcome(failure=failure_line(item, error))
    return DraftOutcome(draft)


def failure_line(item: Item, error: InfthorError) -> str:
    """Return why twins of a trajectory cannot be made, in one line."""
    source, trajectory = item
    return f"{source.place}: {trajectory.traj_id}: {error}"


def count_edits(
    drafts: Iterable[TwinDraft | FinalTaskDraft],
) -> tuple[dict[str, int], dict[str, int], dict[str, int]]:
    """Return the numbers of edits proposed and kept by kind, and of those rejected by reason."""
    proposed = Counter[str]()
    kept = Counter[str]()
    reasons = Counter[str]()
    for draft in drafts:
        proposed.update(draft.proposed)
        kept.update(draft.proposed)
        for kind, rejected in draft.rejected.items():
            kept[kind] -= sum(rejected.values())
            reasons.update(rejected)
    return dict(sorted(proposed.items())), dict(sorted(kept.items())), dict(reasons.most_common())


def _read(file: Path, base: str, settings: TwinSettings, form: type[Draft]) -> Draft:
    """Return the draft of an earlier run, if it is of the same trajectory and settings."""
    draft = read_json(file, _HINT, form)
    if draft.digest != base:
        raise DataError(f"{file}: made of another trajectory of this name; {_HINT}")
    if draft.settings != settings:
        raise DataError(f"{file}: made with other kinds, seed or --per-kind; {_HINT}")
    return draft
