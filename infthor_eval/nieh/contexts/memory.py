"""Memory in words: the model's own notes on the trajectory, and the agent's current view."""

from collections.abc import Sequence

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet, SkippedQuestion
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts.base import ContextPart, ContextSettings, Sample
from infthor_eval.nieh.notes import Notes, NoteSettings

__all__ = ["memory_notes", "notes_parts"]


def memory_notes(data: NiehSet, question: Question, settings: ContextSettings) -> list[Sample | SkippedQuestion]:
    """Ask on the model's notes: on every window of `note_window` frames it writes a note of up to `note_tokens` tokens.

    A note depends on the frames of its window only, not on earlier notes. The paper reports a memory in text
    (long-horizon tasks), but not how the text is written.
    """
    note_settings = NoteSettings(settings.note_window, settings.note_tokens)
    return [Sample(question, tuple(range(len(data.frames(question.traj_id)))), notes=note_settings)]


def notes_parts(_data: NiehSet, sample: Sample, frames: Sequence[FrameRef]) -> list[ContextPart]:
    """Return the notes, then the last frame."""
    if sample.notes is None:
        raise ValueError("a sample of memory_notes lacks the settings of its notes")
    return [Notes(sample.question.traj_id, tuple(frames), sample.notes), frames[-1]]
