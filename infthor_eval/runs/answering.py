"""Having units answered, by a model through its conversation or by a bound from the answer key."""

from typing import Protocol

from infthor_eval.runs.units import Unit
from model_adapters import Bound, Model, Part, Reply

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
    """Keeps one conversation, so that units in the same context share what the model has encoded of it."""

    def __init__(self, model: Model) -> None:
        self._conversation = model.conversation()
        self._start = self._conversation.mark()
        self._after_context = self._start
        self._context: tuple[Part, ...] = ()

    def answer(self, unit: Unit) -> Reply:
        if unit.context != self._context:
            self._conversation.rewind(self._start)
            self._context = ()
            self._conversation.append(*unit.context)
            self._context, self._after_context = unit.context, self._conversation.mark()
        self._conversation.rewind(self._after_context)
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
