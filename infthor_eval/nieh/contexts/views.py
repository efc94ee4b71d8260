"""Contexts that show frames of the trajectory without choosing by the needle: clues, whole, its
end."""

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.nieh.contexts.base import ContextSettings, Sample

__all__ = ["clues", "trajectory", "truncate_head"]

_K_TOKENS = 1024  # truncate_head's published kilo-token


def clues(
    data: NiehSet, question: Question, _settings: ContextSettings
) -> list[Sample | SkippedQuestion]:
    """Ask on the frames that are evidence alone, in time order whatever the file's (the paper's
    Table 4)."""
    if not data.has_frames:  # baselines need no more than their number
        return [Sample(question, tuple(sorted(question.clues)))]
    order = {frame: position for position, frame in enumerate(data.frames(question.traj_id))}
    return [Sample(question, tuple(sorted(order[frame] for frame in data.clue_frames(question))))]


def trajectory(
    data: NiehSet, question: Question, _settings: ContextSettings
) -> list[Sample | SkippedQuestion]:
    """Ask on every frame of the trajectory (published: `full_traj`)."""
    return [Sample(question, tuple(range(len(data.frames(question.traj_id)))))]


def truncate_head(
    data: NiehSet, question: Question, settings: ContextSettings
) -> list[Sample | SkippedQuestion]:
    """The last frames that fit the context (published under the same name); clues before them are
    lost."""
    n_all = len(data.frames(question.traj_id))
    n = settings.n_frames(_K_TOKENS)
    if n < 1:
        return [SkippedQuestion(question, "no frame fits the context")]
    n_cut = max(0, n_all - n)
    return [Sample(question, tuple(range(n_cut, n_all)), n_cut=n_cut)]
