"""What a server answers: read strictly, for it may be anything."""

from typing import Annotated

import msgspec

from infthor_eval.errors import ModelError, in_one_line

__all__ = ["Completion", "TokenUsage", "read_completion"]

# By finish_reason; another one is a stranger's text, and not told.
_WHY = {
    "length": ": all its tokens were used up before one; have the task allow more (max_gen_toks)",
    "content_filter": ": a filter of the server's held it back; ask something else",
    "tool_calls": ": it calls a tool, though it was given none; ask a server without tools",
}
_Count = Annotated[int, msgspec.Meta(ge=0, le=2**48)]


class _Details(msgspec.Struct, frozen=True):
    cached_tokens: _Count | None = None


class TokenUsage(msgspec.Struct, frozen=True):
    """What a reply took.

    Attributes:
        prompt_tokens: of the request, frames included.
        completion_tokens: of the reply, with what it was thought out in, if that is counted.
        prompt_tokens_details: of which so many were in the server's cache.
    """

    prompt_tokens: _Count
    completion_tokens: _Count
    prompt_tokens_details: _Details | None = None

    @property
    def cached(self) -> int | None:
        """Tokens found in the server's cache; None where it does not tell."""
        details = self.prompt_tokens_details
        return (
            None if details is None or details.cached_tokens is None else min(details.cached_tokens, self.prompt_tokens)
        )

    @property
    def total(self) -> int:
        """Tokens of request and reply."""
        return self.prompt_tokens + self.completion_tokens


class _Message(msgspec.Struct, frozen=True):
    content: str | None = None
    refusal: str | None = None


class _Choice(msgspec.Struct, frozen=True):
    message: _Message
    finish_reason: str | None = None


class Completion(msgspec.Struct, frozen=True):
    """A server's answer.

    Attributes:
        choices: replies, of which the first is taken.
        usage: what it took; None where the server does not tell.
    """

    choices: list[_Choice]
    usage: TokenUsage | None = None

    def text(self, where: str) -> str:
        """What was said; a refusal in words is a reply.

        Args:
            where: it was said, for the message.

        Raises:
            ModelError: nothing was.
        """
        if not self.choices:
            raise ModelError(f"{where} answers without a choice; is it a chat model's address?")
        choice = self.choices[0]
        said = choice.message.content
        if said is None:
            said = choice.message.refusal
        if said is not None and (said or choice.finish_reason != "content_filter"):
            return said
        raise ModelError(f"{where} gives no text{_WHY.get(choice.finish_reason or '', '; see its log')}")


def read_completion(where: str, content: bytes) -> Completion:
    """The answer in the bytes of a reply.

    Args:
        where: they came from, for the message.
        content: as received.

    Raises:
        ModelError: they are no answer of a chat model.
    """
    try:
        return msgspec.json.decode(content, type=Completion)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ModelError(
            f"{where} answers what is no chat completion ({in_one_line(error)}); is it a chat model's address?"
        ) from error
