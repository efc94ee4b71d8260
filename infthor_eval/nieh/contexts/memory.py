"""Memory in words: the model's own notes on the trajectory, and the agent's current view."""

from collections.abc import Sequence

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet, SkippedQuestion
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts.base import ContextPart, ContextSettings, Sample
from infthor_eval.nieh.notes import Notes, Notetaking

__all__ = ["memory_notes", "notes_parts"]


def memory_notes(data: NiehSet, question: Question, settings: ContextSettings) -> list[Sample | SkippedQuestion]:
    """Every frame is read, `note_window` at a time, and a note of at most `note_tokens` tokens written on each window.

    A note is made from its window's frames alone, so that it does not hang on the ones before it. The paper reports a
    memory in text (long-horizon tasks); how its text came about is not published.
    """
    taking = Notetaking(settings.note_window, settings.note_tokens)
    return [Sample(question, tuple(range(len(data.frames(question.traj_id)))), notes=taking)]


def notes_parts(_data: NiehSet, sample: Sample, frames: Sequence[FrameRef]) -> list[ContextPart]:
    """The notes, then the last frame."""
    if sample.notes is None:
        raise ValueError("a sample of memory_notes says how notes are taken")
    return [Notes(sample.question.traj_id, tuple(frames), sample.notes), frames[-1]]
