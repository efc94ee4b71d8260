"""Strict parsing of a server's reply, which may be anything."""

import msgspec

from infthor_eval.errors import ModelError
from model_adapters.served.completion import TokenUsage, read_error, read_usage
from model_adapters.served.wire import StatusError

# By finish_reason. Unknown ones are not quoted, because a server may put any text there.
_FILTERED = ": the server's content filter blocked it; change the question"
_WHY = {
    "length": ": the token limit was reached before any text; give --max-thinking-tokens N",
    "content_filter": _FILTERED,
    "sensitive": _FILTERED,
    "tool_calls": ": it calls a tool, though none was offered; use a server without tools",
}


class _Chunk(msgspec.Struct, frozen=True):
    type: str
    text: str | None = None
    thinking: "str | list[_Chunk] | None" = None


class _Message(msgspec.Struct, frozen=True):
    content: str | list[_Chunk] | None = None  # in chunks: Mistral's models that think
    refusal: str | None = None
    reasoning_content: str | None = None
    reasoning: str | None = None  # newer servers' name of the same


class _Choice(msgspec.Struct, frozen=True):
    message: _Message
    finish_reason: str | None = None
    error: msgspec.Raw = msgspec.Raw(b"null")


class ChatCompletion(msgspec.Struct, frozen=True):
    """A server's reply; see `Completion`.

    Attributes:
        choices: alternative replies; the first one is used.
        usage: token counts, or None if the server does not report them.
    """

    choices: list[_Choice] | None = None
    usage: msgspec.Raw = msgspec.Raw(b"null")
    error: msgspec.Raw = msgspec.Raw(b"null")

    @property
    def failure(self) -> StatusError | None:
        """See `Completion`."""
        choice = self._choice
        return read_error(choice.finish_reason, choice.error, self.error)

    @property
    def tokens(self) -> TokenUsage | None:
        """See `Completion`."""
        return read_usage(
            self.usage, ("prompt_tokens",), ("completion_tokens",), "cached_tokens", ""
        )

    @property
    def thinking(self) -> str | None:
        """See `Completion`. Where nothing was said before the token limit, it was thought."""
        message = self._choice.message
        thought = message.reasoning_content or message.reasoning
        thought = thought or _words(message.content, "thinking")
        is_cut_off = self._choice.finish_reason == "length" and message.content is not None
        return thought or ("" if is_cut_off and not _words(message.content) else None)

    def text(self, where: str) -> str:
        """See `Completion`."""
        if not self.choices:
            raise ModelError(f"{where} answers without choices; is it a chat model's address?")
        message = self._choice.message
        reason = self._choice.finish_reason
        why = _WHY.get(reason or "", "; see its log")
        text = _words(message.content) or message.refusal or ""
        is_said = message.content is not None and why != _FILTERED
        if text or is_said or (self.thinking is not None and reason == "length"):
            return text
        raise ModelError(f"{where} gives no text{why}")

    @property
    def _choice(self) -> _Choice:
        return self.choices[0] if self.choices else _Choice(_Message())


def _words(content: str | list[_Chunk] | None, kind: str = "text") -> str:
    """Return what was said, or thought, in the content of a message."""
    if not isinstance(content, list):
        return content or "" if kind == "text" else ""
    words = [
        it.text if kind == "text" else _words(it.thinking) for it in content if it.type == kind
    ]
    return "".join(text or "" for text in words)
