"""How much of the evidence a context shows, and how far from the end of the trajectory it is."""

from infthor_eval.nieh.contexts.base import Sample, clue_positions
from infthor_eval.nieh.records import ShownClues
from infthor_eval.nieh.samples import TaskSamples

__all__ = ["shown_clues"]


def shown_clues(task_samples: TaskSamples, sample: Sample) -> ShownClues | None:
    """Return the clue frames that a sample shows; None for absences, and in a set without
    frames."""
    data = task_samples.data
    question = sample.question
    if question.absence or not data.has_frames:
        return None
    clues = clue_positions(data, question)
    shown = set(task_samples.context.positions(data, sample))
    n_after = len(data.frames(question.traj_id)) - 1 - clues[-1]
    return ShownClues(n_shown=len(shown.intersection(clues)), n_clues=len(clues), n_after=n_after)
