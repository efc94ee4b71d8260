"""Having units answered, by a model through its conversation or by a bound from the answer key."""

from typing import Protocol

from infthor_eval.formats.frames import FrameRef
from infthor_eval.runs.units import Unit
from model_adapters import Bound, Model, Reply

__all__ = ["Answerer", "answerer_for"]


class Answerer(Protocol):
    """Gives the reply to a unit."""

    def answer(self, unit: Unit) -> Reply:
        """The reply to the unit.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the model cannot take the request.
        """


class _ModelAnswerer:
    """Keeps one conversation, so that units on the same frames share what the model has encoded of them."""

    def __init__(self, model: Model) -> None:
        self._conversation = model.conversation()
        self._start = self._conversation.mark()
        self._after_frames = self._start
        self._frames: tuple[FrameRef, ...] = ()

    def answer(self, unit: Unit) -> Reply:
        if unit.frames != self._frames:
            self._conversation.rewind(self._start)
            self._frames = ()
            self._conversation.append(*unit.frames)
            self._frames, self._after_frames = unit.frames, self._conversation.mark()
        self._conversation.rewind(self._after_frames)
        self._conversation.append(unit.text)
        return self._conversation.reply(unit.decoding["max_gen_toks"], unit.decoding.get("until", ()))


class _BoundAnswerer:
    def __init__(self, bound: Bound) -> None:
        self._bound = bound

    def answer(self, unit: Unit) -> Reply:
        return Reply(self._bound.answer(unit.question), (), 0, 0)


def answerer_for(model: Model | Bound) -> Answerer:
    """The way to have this model, or this bound, answer."""
    return _BoundAnswerer(model) if isinstance(model, Bound) else _ModelAnswerer(model)
