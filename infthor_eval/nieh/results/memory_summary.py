"""What a run's memory recalled, at which cost."""

import re
from collections.abc import Sequence
from statistics import fmean

import msgspec

from infthor_eval.memory import read_budget
from infthor_eval.nieh.config import NiehConfig, NiehTaskConfig
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.runs import UnitRecord

_OF_MEMORY = re.compile(r"(?:, )?\b(?:memory|memory_args|budget)=[^,)]*")

Record = UnitRecord[NiehAnswer]


class KeptMeans(msgspec.Struct, frozen=True):
    """Tokens and bytes that were kept of a model's cache, and the share of the clues' tokens."""

    tokens: float
    bytes: float
    clues: float | None

    @classmethod
    def of(cls, records: "Sequence[Record]") -> "KeptMeans | None":
        """Return the means; None if no cache was cut."""
        kept = [record.payload.kept for record in records if record.payload.kept is not None]
        if not kept:
            return None
        clues = [each.clues for each in kept if each.clues is not None]
        return cls(
            fmean(each.tokens for each in kept),
            fmean(each.bytes for each in kept),
            fmean(clues) if clues else None,
        )


class MemorySummary(msgspec.Struct, frozen=True, omit_defaults=True):
    """A task's memory, and what it recalled for a question on average.

    Attributes:
        name: name of the memory, or of the class in a file.
        privileged: it is given what no agent can know.
        budget: most tokens of what is recalled; None for the memory's own limit.
        n_frames: recalled frames of a question.
        n_tokens: tokens of a question with all that is shown, as the model counts them; None if it
            does not.
        kept: what was kept of the model's cache on average; None of other memories.
    """

    name: str
    privileged: bool
    budget: int | None
    n_frames: float
    n_tokens: float | None
    kept: KeptMeans | None = None


class MemoryTimes(msgspec.Struct, frozen=True):
    """Mean seconds of a task's memory to observe a trajectory, and to recall for a question."""

    build_s: float
    recall_s: float


def subject_of(label: str) -> str:
    """Return a run's label without its memory: "nano (budget=1k, seed=2)" is "nano (seed=2)"."""
    return _OF_MEMORY.sub("", label).replace("(, ", "(").replace(" ()", "")


def summarise_memory(
    config: NiehConfig, task: NiehTaskConfig, records: Sequence[Record]
) -> MemorySummary | None:
    """Return the summary of a task's memory; None if it has none."""
    recalls = [record.payload.recall for record in records if record.payload.recall is not None]
    memory = task.memory
    if memory is None or not recalls:
        return None
    tokens = [record.tokens.context for record in records if record.tokens.context is not None]
    return MemorySummary(
        name=memory.name,
        privileged=memory.privileged,
        budget=read_budget(config.budget) if task.budget is None else task.budget,
        n_frames=fmean(recall.n_frames for recall in recalls),
        n_tokens=fmean(tokens) if tokens else None,
        kept=KeptMeans.of(records),
    )


def time_memory(records: Sequence[Record]) -> MemoryTimes | None:
    """Return the seconds of a task's memory; None if it has none."""
    recalls = [
        (_trajectory(record), record.payload.recall)
        for record in records
        if record.payload.recall is not None
    ]
    if not recalls:
        return None
    by_trajectory = {trajectory: recall.build_s for trajectory, recall in recalls}
    return MemoryTimes(
        fmean(by_trajectory.values()), fmean(recall.recall_s for _, recall in recalls)
    )


def _trajectory(record: Record) -> str:
    twin = record.payload.twin
    return record.cluster if twin is None else twin.traj_id
