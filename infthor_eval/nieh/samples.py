"""What a task asks: every question of its set in every way its context knows, and what cannot be asked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.hub_data import default_folder
from infthor_eval.formats.nieh_set import NiehSet, SkippedQuestion
from infthor_eval.formats.packaged import packaged_folder
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import Context, ContextPart, ContextSettings, Sample, context_named
from infthor_eval.nieh.stand_ins import StandIns
from infthor_eval.runs.limiting import spread

__all__ = ["TaskSamples", "find_samples", "find_set", "open_set"]


@dataclass(frozen=True)
class TaskSamples:
    """What one task asks.

    Attributes:
        data: the set.
        context_name: name of the context that questions are asked in.
        context: the context.
        samples: what is asked, in the order of the set.
        skipped: what is not, and why.
        sources: what the frames depend on besides the set and the settings (`Context.sources`).
        stand_ins: what is shown in the places of frames.
    """

    data: NiehSet
    context_name: str
    context: Context
    samples: Sequence[Sample]
    skipped: Sequence[SkippedQuestion]
    sources: Mapping[str, Any]
    stand_ins: StandIns = field(default_factory=StandIns)

    def request(self, sample: Sample) -> tuple[list[ContextPart], str]:
        """All that a model is shown and told: the context, and the text with the question that follows it."""
        parts, text = self.context.request(self.data, sample)
        return self.stand_ins.put(parts, self.data, self.context, sample.question.traj_id), text


@lru_cache(maxsize=8)
def open_set(root: str, trajectories: str | None = None) -> NiehSet:
    """The set in a folder, read once per process; `open_set.cache_clear()` has it read again."""
    return NiehSet(Path(root), Path(trajectories) if trajectories else None)


def find_set(
    data: str | None = None, bundled: str | None = None, trajectories: str | None = None, **_: object
) -> NiehSet:
    """The set of a task.

    Args:
        data: folder of an NIEH set; None is the published set where `infthor-eval fetch nieh` put it.
        bundled: name of a set that comes with the package; `data` is not looked at then.
        trajectories: folder of the set's trajectories; None where they lie in the set.

    Raises:
        UsageError: there is none.
        DataError: it cannot be read.
    """
    if bundled:
        return open_set(str(packaged_folder(f"sets/{bundled}")), trajectories)
    if data is None and not default_folder().is_dir():
        raise UsageError(
            "no NIEH set to ask about; give its folder with --data, or fetch the published one: fetch nieh"
        )
    return open_set(str(data or default_folder()), trajectories)


def find_samples(config: Mapping[str, Any], limit: int | None = None) -> TaskSamples:
    """Everything that a task asks.

    Args:
        config: `dataset_kwargs` of the task file and what the run tells beside it: the name of the context, what
            `find_set` takes, and the context's settings (`infthor_eval.nieh.contexts.ContextSettings`).
        limit: ask only so many questions, evenly from all trajectories, drawn by the seed; None asks all.

    Raises:
        UsageError: there is no set, the context is unknown or lacks a setting, or the set has no such stand-ins.
        DataError: the set cannot be read.
    """
    context, settings, data = context_named(config["context"]), ContextSettings.read(config), find_set(**config)
    stand_ins = StandIns(settings.frames, settings.seed)
    stand_ins.check(data)
    found = [item for items in _by_question(data, context, settings, limit) for item in items]
    samples = [item for item in found if isinstance(item, Sample)]
    skipped = [item for item in found if isinstance(item, SkippedQuestion)]
    return TaskSamples(data, config["context"], context, samples, skipped, context.sources(data, settings), stand_ins)


_Found = list[Sample | SkippedQuestion]


def _by_question(data: NiehSet, context: Context, settings: ContextSettings, limit: int | None) -> list[_Found]:
    """What comes of each question, in the order of the set; with a limit, of those that were looked at to reach it."""
    problems: dict[FrameRef, str | None] = {}

    def checked(sample: Sample) -> Sample | SkippedQuestion:
        problem = _problem(context.shown(data, sample), problems)
        return SkippedQuestion(sample.question, problem, sample.variant) if problem else sample

    places = range(len(data.rows)) if limit is None else spread(data.rows, _trajectory_of, settings.seed)
    by_place: dict[int, _Found] = {}
    n_asked = 0
    for place in places:
        row = data.rows[place]
        found = _samples(context, data, row, settings) if isinstance(row, Question) else [row]
        by_place[place] = [checked(item) if isinstance(item, Sample) else item for item in found]
        n_asked += any(isinstance(item, Sample) for item in by_place[place])
        if n_asked == limit:
            break
    return [by_place[place] for place in sorted(by_place)]


def _trajectory_of(row: Question | SkippedQuestion) -> str:
    return row.traj_id if isinstance(row, Question) else row.question.traj_id


def _samples(context: Context, data: NiehSet, question: Question, settings: ContextSettings) -> _Found:
    try:
        return context.samples(data, question, settings)
    except DataError as error:  # of this trajectory's frames; the others can be asked about
        return [SkippedQuestion(question, str(error))]


def _problem(frames: list[FrameRef], known: dict[FrameRef, str | None]) -> str | None:
    """Why one of the frames cannot be shown; None where all can. Each frame's file is looked at once."""
    for frame in frames:
        if frame not in known:
            known[frame] = frame.problem()
        if known[frame]:
            return known[frame]
    return None
