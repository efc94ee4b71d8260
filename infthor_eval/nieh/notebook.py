"""Notes that a model takes on trajectories, each of them once per run."""

import time

from infthor_eval.formats.digests import fingerprint
from infthor_eval.nieh.notes import Notes, Window
from infthor_eval.nieh.records import NiehAnswer, NiehNote
from infthor_eval.runs import Session, Usage
from model_adapters import Decoding, Model

__all__ = ["Notebook"]


class Notebook:
    """A model's notes, cached in the run's journal: a resumed run uses the same ones."""

    def __init__(self, model: Model, session: Session[NiehAnswer]) -> None:
        self._conversation = model.conversation()
        self._start = self._conversation.mark()
        self._session = session

    def text(self, notes: Notes) -> str:
        """Return the text of notes; missing ones are taken first.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the model cannot take a window of frames.
        """
        return notes.text([self._note(notes, window) for window in notes.windows])

    def _note(self, notes: Notes, window: Window) -> str:
        decoding = Decoding(max_new_tokens=notes.settings.max_new_tokens)
        digests = [frame.digest for frame in window.frames]
        inputs = fingerprint({"frames": digests, "text": window.request[-1], "decoding": decoding.document()})
        note = self._session.find_artifact(inputs, NiehNote)
        if note is None:
            note, usage = self._take_note(notes, window, decoding)
            self._session.cache_artifact(inputs, note, usage)
        return note.note

    def _take_note(self, notes: Notes, window: Window, decoding: Decoding) -> tuple[NiehNote, Usage]:
        start = time.perf_counter()
        self._conversation.rewind(self._start)
        self._conversation.append(*window.request)
        reply = self._conversation.reply(decoding)
        note = NiehNote(
            note=reply.text,
            traj_id=notes.traj_id,
            steps=window.steps,
            n_context_tokens=reply.n_context_tokens,
            n_reply_tokens=reply.n_reply_tokens,
            seconds=round(time.perf_counter() - start, 4),
        )
        return note, Usage.of([reply])
