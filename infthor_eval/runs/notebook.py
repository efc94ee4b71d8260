"""Having a model take notes on a trajectory, each of them once per run."""

import time

from infthor_eval.formats.digests import fingerprint
from infthor_eval.nieh.notes import Notes, Window
from infthor_eval.runs.journal import Journal, NoteRecord
from model_adapters import Model

__all__ = ["Notebook"]


class Notebook:
    """A model's notes, kept in the run's journal: a stopped run goes on with the same ones."""

    def __init__(self, model: Model, journal: Journal) -> None:
        self._conversation = model.conversation()
        self._start = self._conversation.mark()
        self._journal = journal

    def text(self, notes: Notes) -> str:
        """The notes as they are shown; the missing ones are taken first.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the model cannot take a window of frames.
        """
        return notes.text([self._note(notes, window) for window in notes.windows])

    def _note(self, notes: Notes, window: Window) -> str:
        limit = notes.taking.max_new_tokens
        digests = [frame.digest for frame in window.frames]
        inputs = fingerprint({"frames": digests, "text": window.request[-1], "limit": limit})
        known = self._journal.note(inputs)
        if known is not None:
            return known.note
        began = time.perf_counter()
        self._conversation.rewind(self._start)
        self._conversation.append(*window.request)
        reply = self._conversation.reply(limit)
        record = NoteRecord(
            note=reply.text,
            fingerprint=inputs,
            traj_id=notes.traj_id,
            steps=window.steps,
            n_context_tokens=reply.n_context_tokens,
            n_reply_tokens=len(reply.token_ids),
            seconds=round(time.perf_counter() - began, 4),
        )
        self._journal.append_note(record)
        return record.note
