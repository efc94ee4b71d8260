"""A conversation on top of whatever answers a whole conversation at a time."""

from collections.abc import Sequence
from typing import Protocol

from model_adapters.protocols import Capabilities, Decoding, Part, Reply, Turn
from model_adapters.refusals import check_decoding, check_turns
from model_adapters.transcript import Transcript

__all__ = ["Backend", "BackendConversation"]


class Backend(Protocol):
    """What answers: it gets all turns every time and finds out by itself what it has seen before.

    The last turn is always the user's, and nothing is asked that the capabilities rule out.
    """

    @property
    def name(self) -> str:
        """Its name, for messages."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """What it can do."""
        ...

    def count(self, turns: Sequence[Turn]) -> int | None:
        """Tokens that a reply to these turns would be made from; None where it counts none."""
        ...

    def answer(self, turns: Sequence[Turn], decoding: Decoding) -> Reply:
        """Answer a conversation; see `Conversation.reply`."""
        ...

    def answer_each(self, conversations: Sequence[Sequence[Turn]], decoding: Decoding) -> list[Reply]:
        """Answer several conversations, each for itself; see `Conversation.replies`."""
        ...


class BackendConversation(Transcript):
    """A conversation that keeps the turns and leaves the rest to a back end."""

    def __init__(self, backend: Backend) -> None:
        super().__init__()
        self._backend = backend

    @property
    def n_tokens(self) -> int | None:
        """Tokens that `reply` would give the model now.

        Raises:
            DataError: a frame cannot be read.
            ModelError: there is nothing to reply to, or the model cannot take the turns as they stand.
        """
        return self._backend.count(self._asked())

    def reply(self, decoding: Decoding) -> Reply:
        """The assistant's next turn; see `Conversation.reply`."""
        check_decoding(self._backend.name, self._backend.capabilities, decoding)
        return self._backend.answer(self._asked(), decoding)

    def replies(self, continuations: Sequence[Sequence[Part]], decoding: Decoding) -> list[Reply]:
        """The replies to several continuations; see `Conversation.replies`."""
        check_decoding(self._backend.name, self._backend.capabilities, decoding)
        return self._backend.answer_each([self._asked(parts) for parts in continuations], decoding)

    def _asked(self, continuation: Sequence[Part] = ()) -> tuple[Turn, ...]:
        turns = self.turns_with(continuation)
        check_turns(self._backend.name, turns)
        return turns
