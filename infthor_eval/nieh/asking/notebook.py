"""Texts that the model under test writes for a memory, each of them once per run."""

import time
from collections.abc import Sequence

from infthor_eval.formats.frames import FrameRef
from infthor_eval.nieh.records import NiehAnswer, NiehNote
from infthor_eval.runs import Session, Usage
from infthor_eval.storage.digests import fingerprint
from model_adapters import Decoding, Model, answer_of, wrap_request_errors


class Notebook:
    """A model's notes, cached in the run's journal: a resumed run uses the same ones."""

    def __init__(self, model: Model, session: Session[NiehAnswer]) -> None:
        self._name = model.name
        self._conversation = model.conversation()
        self._start = self._conversation.mark()
        self._session = session

    def write(self, parts: Sequence[str | FrameRef], max_new_tokens: int) -> str:
        """Return what the model writes when given texts and frames
        (`infthor_eval.memory.Write`)."""
        decoding = Decoding(max_new_tokens=max_new_tokens)
        content = [[part.digest] if isinstance(part, FrameRef) else part for part in parts]
        inputs = fingerprint({"parts": content, "decoding": decoding.document()})
        note = self._session.find_artifact(inputs, NiehNote)
        if note is None:
            note, usage = self._take_note(parts, decoding)
            self._session.cache_artifact(inputs, note, usage)
        return note.note

    def _take_note(
        self, parts: Sequence[str | FrameRef], decoding: Decoding
    ) -> tuple[NiehNote, Usage]:
        start = time.perf_counter()
        with wrap_request_errors(self._name):
            self._conversation.rewind(self._start)
            self._conversation.append(*parts)
            reply = self._conversation.reply(decoding)
        note = NiehNote(
            note=answer_of(reply).answer,
            n_frames=sum(isinstance(part, FrameRef) for part in parts),
            n_context_tokens=reply.n_context_tokens,
            n_reply_tokens=reply.n_reply_tokens,
            seconds=round(time.perf_counter() - start, 4),
        )
        return note, Usage.of([reply])
