"""A conversation on top of a back end that answers a whole conversation at a time."""

from collections.abc import Sequence
from typing import Protocol

from infthor_eval.formats.frames import FrameRef
from model_adapters.protocols import Capabilities, Decoding, Part, Reply, Turn
from model_adapters.refusals import check_decoding, check_turns
from model_adapters.transcript import Transcript


class Backend(Protocol):
    """A stateless answering model: it gets all turns with every request and does its own caching.

    The last turn is always the user's, and no request exceeds the capabilities.
    """

    @property
    def name(self) -> str:
        """Name of the model, for messages."""

    @property
    def capabilities(self) -> Capabilities:
        """Capabilities of the model."""

    def count(self, turns: Sequence[Turn]) -> int | None:
        """Return the context size of a reply to these turns, in tokens, or None if the model does
        not count them."""

    def answer(self, turns: Sequence[Turn], decoding: Decoding) -> Reply:
        """Answer a conversation; see `Conversation.reply`."""

    def answer_each(
        self, conversations: Sequence[Sequence[Turn]], decoding: Decoding
    ) -> list[Reply]:
        """Answer several conversations independently; see `Conversation.replies`."""


class BackendConversation(Transcript):
    """A conversation that keeps the turns and delegates counting and answering to a back end."""

    def __init__(self, backend: Backend) -> None:
        super().__init__()
        self._backend = backend

    @property
    def n_tokens(self) -> int | None:
        """Tokens that `reply` would give the model now, or None if it does not count them.

        Raises:
            DataError: a frame cannot be read.
            ModelError: there is nothing to reply to, or the model does not support these turns.
        """
        return self._backend.count(self._checked_turns())

    def reply(self, decoding: Decoding) -> Reply:
        """Return the assistant's next turn; see `Conversation.reply`."""
        check_decoding(self._backend.name, self._backend.capabilities, decoding)
        return self._backend.answer(self._checked_turns(), decoding)

    def replies(self, continuations: Sequence[Sequence[Part]], decoding: Decoding) -> list[Reply]:
        """Return the replies to several continuations; see `Conversation.replies`."""
        check_decoding(self._backend.name, self._backend.capabilities, decoding)
        return self._backend.answer_each(
            [self._checked_turns(parts) for parts in continuations], decoding
        )

    def _checked_turns(self, continuation: Sequence[Part] = ()) -> tuple[Turn, ...]:
        turns = self.turns_with(continuation)
        check_turns(self._backend.name, self._backend.capabilities, turns)
        return turns


class UncountedBackend:
    """Base of back ends that count no tokens and answer one conversation after the other."""

    def tokens_per_frame(self, frame: FrameRef) -> None:
        """Return None: tokens are not counted."""

    def count(self, turns: Sequence[Turn]) -> None:
        """Return None: tokens are not counted."""

    def conversation(self: Backend) -> BackendConversation:
        """Return a new, empty conversation."""
        return BackendConversation(self)

    def answer_each(
        self: Backend, conversations: Sequence[Sequence[Turn]], decoding: Decoding
    ) -> list[Reply]:
        """See `Backend`."""
        return [self.answer(turns, decoding) for turns in conversations]
