"""Strict parsing of a server's reply, which may be anything."""

from typing import Annotated

import msgspec

from infthor_eval.errors import ModelError
from model_adapters.served.completion import TokenUsage, decode_reply

__all__ = ["ChatCompletion", "read_completion"]

# By finish_reason. Unknown ones are not quoted, because a server may put any text there.
_WHY = {
    "length": ": the token limit was reached before any text; raise max_gen_toks of the task",
    "content_filter": ": the server's content filter blocked it; change the question",
    "tool_calls": ": it calls a tool, though none was offered; use a server without tools",
}
_Count = Annotated[int, msgspec.Meta(ge=0, le=2**48)]


class _Details(msgspec.Struct, frozen=True):
    cached_tokens: _Count | None = None


class _Usage(msgspec.Struct, frozen=True):
    prompt_tokens: _Count
    completion_tokens: _Count
    prompt_tokens_details: _Details | None = None


class _Message(msgspec.Struct, frozen=True):
    content: str | None = None
    refusal: str | None = None
    reasoning_content: str | None = None
    reasoning: str | None = None  # newer servers' name of the same


class _Choice(msgspec.Struct, frozen=True):
    message: _Message
    finish_reason: str | None = None


class ChatCompletion(msgspec.Struct, frozen=True):
    """A server's reply; see `Completion`.

    Attributes:
        choices: alternative replies; the first one is used.
        usage: token counts, or None if the server does not report them.
    """

    choices: list[_Choice]
    usage: _Usage | None = None

    @property
    def tokens(self) -> TokenUsage | None:
        """See `Completion`."""
        usage = self.usage
        if usage is None:
            return None
        details = usage.prompt_tokens_details
        cached = None if details is None else details.cached_tokens
        return TokenUsage(
            usage.prompt_tokens,
            usage.completion_tokens,
            None if cached is None else min(cached, usage.prompt_tokens),
        )

    @property
    def thinking(self) -> str | None:
        """See `Completion`."""
        message = self.choices[0].message if self.choices else _Message()
        return message.reasoning_content or message.reasoning or None

    def text(self, where: str) -> str:
        """See `Completion`."""
        if not self.choices:
            raise ModelError(f"{where} answers without choices; is it a chat model's address?")
        choice = self.choices[0]
        text = choice.message.content
        if text is None:
            text = choice.message.refusal
        if text is not None and (text or choice.finish_reason != "content_filter"):
            return text
        if self.thinking is not None and choice.finish_reason == "length":
            return ""
        raise ModelError(
            f"{where} gives no text{_WHY.get(choice.finish_reason or '', '; see its log')}"
        )


def read_completion(where: str, content: bytes) -> ChatCompletion:
    """Parse a server's reply.

    Raises:
        ModelError: the body is not a chat completion.
    """
    return decode_reply(where, content, ChatCompletion, "a chat completion")
