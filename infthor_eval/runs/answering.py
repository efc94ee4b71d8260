"""Having units answered, by a model through its conversation or by a bound from the answer key."""

from collections.abc import Sequence
from typing import Protocol

from infthor_eval.formats.frames import FrameRef
from infthor_eval.nieh.contexts import Part
from infthor_eval.nieh.notes import Notes
from infthor_eval.runs.journal import Journal
from infthor_eval.runs.notebook import Notebook
from infthor_eval.runs.units import Unit
from model_adapters import BatchingConversation, Bound, Model, Reply

__all__ = ["Answerer", "answerer_for"]


class Answerer(Protocol):
    """Gives the replies to units."""

    @property
    def batch_size(self) -> int:
        """How many units are worth handing over at once."""

    def read(self, context: Sequence[Part]) -> tuple[str | FrameRef, ...]:
        """A context as it is shown: with the model's notes, which it takes now if it has not yet, as text.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the model cannot take notes on so many frames.
        """

    def answer(self, units: Sequence[Unit]) -> list[Reply]:
        """The replies to units that share their context and decoding settings.

        Raises:
            DataError: a frame cannot be read; nothing is answered then.
            ModelError: the model cannot take one of the requests; nothing is answered then.
        """


class _ModelAnswerer:
    """Keeps one conversation, so that units in the same context share what the model has encoded of it."""

    def __init__(self, model: Model, journal: Journal) -> None:
        self._notebook = Notebook(model, journal)
        self._conversation = model.conversation()
        self._start = self._conversation.mark()
        self._after_context = self._start
        self._context: tuple[str | FrameRef, ...] = ()

    @property
    def batch_size(self) -> int:
        return self._conversation.batch_size if isinstance(self._conversation, BatchingConversation) else 1

    def read(self, context: Sequence[Part]) -> tuple[str | FrameRef, ...]:
        return tuple(self._notebook.text(part) if isinstance(part, Notes) else part for part in context)

    def answer(self, units: Sequence[Unit]) -> list[Reply]:
        context, decoding = units[0].shown, units[0].decoding
        if context != self._context:
            self._conversation.rewind(self._start)
            self._context = ()
            self._conversation.append(*context)
            self._context, self._after_context = context, self._conversation.mark()
        self._conversation.rewind(self._after_context)
        limits = decoding["max_gen_toks"], decoding.get("until", ())
        if len(units) > 1 and isinstance(self._conversation, BatchingConversation):
            return self._conversation.replies([[unit.text] for unit in units], *limits)
        return [self._reply(unit, *limits) for unit in units]

    def _reply(self, unit: Unit, max_new_tokens: int, stop: Sequence[str]) -> Reply:
        self._conversation.rewind(self._after_context)
        self._conversation.append(unit.text)
        return self._conversation.reply(max_new_tokens, stop)


class _BoundAnswerer:
    batch_size = 1

    def __init__(self, bound: Bound) -> None:
        self._bound = bound

    def read(self, context: Sequence[Part]) -> tuple[str | FrameRef, ...]:
        return tuple(part for part in context if not isinstance(part, Notes))  # it looks at nothing and notes nothing

    def answer(self, units: Sequence[Unit]) -> list[Reply]:
        return [Reply(self._bound.answer(unit.question), (), 0, 0) for unit in units]


def answerer_for(model: Model | Bound, journal: Journal) -> Answerer:
    """The way to have this model, or this bound, answer.

    Args:
        model: what answers.
        journal: takes the notes of a model.
    """
    return _BoundAnswerer(model) if isinstance(model, Bound) else _ModelAnswerer(model, journal)
