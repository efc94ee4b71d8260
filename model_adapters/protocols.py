"""What a model is to the harness.

A conversation is an append-only list of parts with marks. Whoever evaluates appends what the model is to see, asks
for a reply, and rewinds to a mark; how a back end avoids encoding the same parts twice is its own business.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question

__all__ = [
    "Adapter",
    "BatchingConversation",
    "Bound",
    "Conversation",
    "ExtendableModel",
    "Mark",
    "Model",
    "Part",
    "Reply",
]

Part = str | FrameRef


@dataclass(frozen=True)
class Reply:
    """What a model answered.

    Attributes:
        text: the reply without end-of-turn tokens, cut before the first stop string.
        token_ids: the generated ids without the end-of-turn token; where a stop string ended the reply, up to the
            token that completed it.
        n_context_tokens: tokens of the whole context that the reply was made from, frames expanded.
        n_cached_tokens: how many of them were not encoded again; 0 where the back end does not know.
    """

    text: str
    token_ids: tuple[int, ...]
    n_context_tokens: int
    n_cached_tokens: int


@dataclass(frozen=True, eq=False)
class Mark:
    """A point of one conversation, handed out by `Conversation.mark` and compared by identity.

    Attributes:
        n_parts: how many parts the conversation had.
    """

    n_parts: int


@runtime_checkable
class Conversation(Protocol):
    """What a model has seen so far, as one user turn of texts and frames."""

    @property
    def n_tokens(self) -> int:
        """Tokens that `reply` would give the model now, chat template included and frames expanded."""
        ...

    def append(self, *parts: Part) -> None:
        """Add parts at the end. Texts that touch are read as one text, without anything between them.

        Raises:
            TypeError: a part is neither text nor a frame reference.
        """
        ...

    def mark(self) -> Mark:
        """The present end, to come back to."""
        ...

    def rewind(self, mark: Mark) -> None:
        """Forget all that was appended after the mark; marks set after it die, the mark itself stays good.

        Raises:
            ValueError: the mark is another conversation's, or lies after a point that was rewound to.
        """
        ...

    def reply(self, max_new_tokens: int, stop: Sequence[str] = ()) -> Reply:
        """Answer greedily; the conversation stays as it was (append the reply's text if it is to be remembered).

        Args:
            max_new_tokens: at least 1.
            stop: strings that end the reply; the first to appear is cut off with what follows.

        Raises:
            ModelError: the context does not fit (the message gives its tokens and the limit) or memory ran out.
            DataError: a frame cannot be read.
        """
        ...


@runtime_checkable
class BatchingConversation(Conversation, Protocol):
    """A conversation that can answer several endings at once, which saves time where the back end works in batches."""

    @property
    def batch_size(self) -> int:
        """How many endings are worth handing over at once: as many are computed together."""
        ...

    def replies(self, endings: Sequence[Sequence[Part]], max_new_tokens: int, stop: Sequence[str] = ()) -> list[Reply]:
        """What append, reply, rewind would give for each ending; the conversation stays as it was.

        Args:
            endings: the parts to append, one sequence per question.
            max_new_tokens: at least 1, for each.
            stop: strings that end a reply.

        Raises:
            ModelError: one of the contexts does not fit, or memory ran out; nothing is answered then.
            DataError: a frame cannot be read; nothing is answered then.
        """
        ...


@runtime_checkable
class Model(Protocol):
    """A model that can be talked to."""

    @property
    def name(self) -> str:
        """Its name in the registry."""
        ...

    @property
    def max_tokens(self) -> int | None:
        """Limit of context and reply together, in tokens; None where there is none."""
        ...

    def identity(self) -> dict[str, Any]:
        """All that can change a number, as JSON values; two models of equal identity answer alike."""
        ...

    def tokens_per_frame(self, frame: FrameRef) -> int:
        """How many of the model's tokens one frame becomes, its surroundings in the chat template not counted.

        Raises:
            DataError: the frame cannot be read.
        """
        ...

    def conversation(self) -> Conversation:
        """A new, empty conversation."""
        ...

    def close(self) -> None:
        """Give the memory back; the model cannot be used afterwards."""
        ...


@runtime_checkable
class ExtendableModel(Model, Protocol):
    """A model whose context can be extended beyond what it was trained on."""

    @property
    def max_tokens_before_extension(self) -> int | None:
        """The checkpoint's own limit where it is extended; None where nothing is extended."""
        ...


@runtime_checkable
class Bound(Protocol):
    """A yardstick that answers from the answer key and the question's text; it never sees a frame."""

    @property
    def name(self) -> str:
        """Its name in the registry."""
        ...

    def identity(self) -> dict[str, Any]:
        """All that can change a number, as JSON values."""
        ...

    def study(self, questions: Sequence[Question]) -> None:
        """Read the whole answer key, once, before the first answer."""
        ...

    def answer(self, question: Question) -> str:
        """The answer to one question."""
        ...


class Adapter(Protocol):
    """What a registered "module:Class" must be: options as a dataclass with defaults, and a way to build."""

    Options: ClassVar[type]

    @classmethod
    def build(cls, name: str, options: Any, seed: int) -> Model | Bound:
        """Make the model.

        Args:
            name: the name it was asked for.
            options: an instance of `Options`.
            seed: for whatever is random in it.
        """
        ...
