"""What a dialect reads in a server's reply."""

from dataclasses import dataclass
from typing import Protocol, TypeVar

import msgspec

from infthor_eval.errors import ModelError, in_one_line

__all__ = ["Completion", "TokenUsage", "decode_reply"]

T = TypeVar("T")


@dataclass(frozen=True)
class TokenUsage:
    """Tokens of one request and its reply.

    Attributes:
        prompt_tokens: tokens of the request, frames included.
        completion_tokens: tokens of the reply, including its reasoning if the server counts that.
        n_cached: tokens of the request that were in the server's cache, or None if it does not
            report them.
        n_stored: tokens of the request that were put into the server's cache at a price of their
            own.
    """

    prompt_tokens: int
    completion_tokens: int
    n_cached: int | None = None
    n_stored: int = 0

    @property
    def total(self) -> int:
        """Tokens of request and reply."""
        return self.prompt_tokens + self.completion_tokens


class Completion(Protocol):
    """A reply that was parsed strictly."""

    @property
    def tokens(self) -> TokenUsage | None:
        """Token counts, or None if the server does not report them."""

    @property
    def thinking(self) -> str | None:
        """What the model thought before its reply, if the server tells it apart."""

    def text(self, where: str) -> str:
        """Return the text of the reply; a refusal in words counts as a reply. The message names the
        server by `where`.

        The text is empty where the model was cut off while it thought.

        Raises:
            ModelError: the reply has no text.
        """


def decode_reply(where: str, content: bytes, kind: type[T], what: str) -> T:
    """Parse a server's reply, which may be anything.

    Raises:
        ModelError: the body is not of this kind.
    """
    try:
        return msgspec.json.decode(content, type=kind)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ModelError(
            f"{where} does not answer with {what} ({in_one_line(error)}); is it a chat model's "
            "address?"
        ) from error
