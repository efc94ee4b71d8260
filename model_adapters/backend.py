"""A conversation on top of whatever answers one user turn at a time."""

from collections.abc import Sequence
from typing import Protocol

from model_adapters.protocols import Part, Reply
from model_adapters.transcript import Transcript

__all__ = ["Backend", "BackendConversation", "OneByOne"]


class Backend(Protocol):
    """What answers: it gets all parts every time and finds out by itself what it has seen before."""

    def count(self, parts: Sequence[Part]) -> int:
        """Tokens that a reply to these parts would be made from."""
        ...

    def answer(self, parts: Sequence[Part], max_new_tokens: int, stop: Sequence[str]) -> Reply:
        """Answer one user turn of these parts; see `Conversation.reply`."""
        ...

    def answer_each(self, prompts: Sequence[Sequence[Part]], max_new_tokens: int, stop: Sequence[str]) -> list[Reply]:
        """Answer several user turns, each for itself; `OneByOne` has this for back ends that gain nothing by it."""
        ...


class OneByOne:
    """Base of back ends that answer several turns one after the other."""

    def answer_each(
        self: Backend, prompts: Sequence[Sequence[Part]], max_new_tokens: int, stop: Sequence[str]
    ) -> list[Reply]:
        """Answer several user turns, each for itself."""
        return [self.answer(parts, max_new_tokens, stop) for parts in prompts]


class BackendConversation(Transcript):
    """A conversation that keeps the parts and leaves the rest to a back end.

    Attributes:
        batch_size: how many endings the back end answers together.
    """

    def __init__(self, backend: Backend, batch_size: int = 1) -> None:
        super().__init__()
        self.batch_size = batch_size
        self._backend = backend

    @property
    def n_tokens(self) -> int:
        """Tokens that `reply` would give the model now."""
        return self._backend.count(self.parts)

    def reply(self, max_new_tokens: int, stop: Sequence[str] = ()) -> Reply:
        """Answer greedily; see `Conversation.reply`."""
        _check(max_new_tokens)
        return self._backend.answer(self.parts, max_new_tokens, stop)

    def replies(self, endings: Sequence[Sequence[Part]], max_new_tokens: int, stop: Sequence[str] = ()) -> list[Reply]:
        """Answer several endings, each appended to what is here; see `BatchingConversation.replies`."""
        _check(max_new_tokens)
        prompts = []
        for ending in endings:
            here = self.mark()
            self.append(*ending)
            prompts.append(self.parts)
            self.rewind(here)
        return self._backend.answer_each(prompts, max_new_tokens, stop)


def _check(max_new_tokens: int) -> None:
    if max_new_tokens < 1:
        raise ValueError(f"max_new_tokens must be at least 1, not {max_new_tokens}")
