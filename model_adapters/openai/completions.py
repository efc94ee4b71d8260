"""Strict parsing of a server's reply, which may be anything."""

from typing import Annotated

import msgspec

from infthor_eval.errors import ModelError, in_one_line

__all__ = ["Completion", "TokenUsage", "read_completion"]

# By finish_reason. Unknown ones are not quoted, because a server may put any text there.
_WHY = {
    "length": ": the token limit was reached before any text; raise max_gen_toks of the task",
    "content_filter": ": the server's content filter blocked it; change the question",
    "tool_calls": ": it calls a tool, though none was offered; use a server without tools",
}
_Count = Annotated[int, msgspec.Meta(ge=0, le=2**48)]


class _Details(msgspec.Struct, frozen=True):
    cached_tokens: _Count | None = None


class TokenUsage(msgspec.Struct, frozen=True):
    """Tokens of one request and its reply.

    Attributes:
        prompt_tokens: tokens of the request, frames included.
        completion_tokens: tokens of the reply, including its reasoning if the server counts that.
        prompt_tokens_details: tokens of the request that were in the server's cache.
    """

    prompt_tokens: _Count
    completion_tokens: _Count
    prompt_tokens_details: _Details | None = None

    @property
    def n_cached(self) -> int | None:
        """Tokens of the request in the server's cache, or None if it does not report them."""
        details = self.prompt_tokens_details
        return (
            None
            if details is None or details.cached_tokens is None
            else min(details.cached_tokens, self.prompt_tokens)
        )

    @property
    def total(self) -> int:
        """Tokens of request and reply."""
        return self.prompt_tokens + self.completion_tokens


class _Message(msgspec.Struct, frozen=True):
    content: str | None = None
    refusal: str | None = None
    reasoning_content: str | None = None
    reasoning: str | None = None  # newer servers' name of the same


class _Choice(msgspec.Struct, frozen=True):
    message: _Message
    finish_reason: str | None = None


class Completion(msgspec.Struct, frozen=True):
    """A server's reply.

    Attributes:
        choices: alternative replies; the first one is used.
        usage: token counts, or None if the server does not report them.
    """

    choices: list[_Choice]
    usage: TokenUsage | None = None

    @property
    def thinking(self) -> str | None:
        """What the model thought before its reply, if the server tells it apart."""
        message = self.choices[0].message if self.choices else _Message()
        return message.reasoning_content or message.reasoning or None

    def text(self, where: str) -> str:
        """Return the text of the reply; a refusal in words counts as a reply. The message names the
        server by `where`.

        The text is empty where the model was cut off while it thought.

        Raises:
            ModelError: the reply has no text.
        """
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


def read_completion(where: str, content: bytes) -> Completion:
    """Parse a server's reply.

    Raises:
        ModelError: the body is not a chat completion.
    """
    try:
        return msgspec.json.decode(content, type=Completion)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ModelError(
            f"{where} does not answer with a chat completion ({in_one_line(error)}); is it a chat "
            "model's address?"
        ) from error
