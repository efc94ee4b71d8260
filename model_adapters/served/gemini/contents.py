"""Conversations as contents of the Gemini API, and its replies, which may be anything."""

from collections.abc import Sequence
from typing import Annotated, Any

import msgspec

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.protocols import Turn, Video
from model_adapters.served.completion import TokenUsage, decode_reply
from model_adapters.served.frames import EncodedFrames, require_user_frames

__all__ = ["GeneratedContent", "read_content", "to_contents"]

_WHY = {
    "MAX_TOKENS": ": the token limit was reached before any text; raise max_gen_toks of the task",
    "MALFORMED_FUNCTION_CALL": ": it calls a tool, though none was offered; use another model",
}
_BLOCKED = ("SAFETY", "RECITATION", "BLOCKLIST", "PROHIBITED_CONTENT", "SPII", "IMAGE_SAFETY")
_FILTERED = ": the server's content filter blocked it; change the question"
_Count = Annotated[int, msgspec.Meta(ge=0, le=2**48)]


class _Part(msgspec.Struct, frozen=True):
    text: str = ""
    thought: bool = False


class _Content(msgspec.Struct, frozen=True):
    parts: list[_Part] = []


class _Candidate(msgspec.Struct, frozen=True, rename="camel"):
    content: _Content = _Content()
    finish_reason: str | None = None


class _Feedback(msgspec.Struct, frozen=True, rename="camel"):
    block_reason: str | None = None


class _Usage(msgspec.Struct, frozen=True, rename="camel"):
    prompt_token_count: _Count = 0
    candidates_token_count: _Count = 0
    thoughts_token_count: _Count = 0
    cached_content_token_count: _Count | None = None


class GeneratedContent(msgspec.Struct, frozen=True, rename="camel"):
    """A server's reply; see `Completion`."""

    candidates: list[_Candidate] = []
    prompt_feedback: _Feedback = _Feedback()
    usage_metadata: _Usage | None = None

    @property
    def tokens(self) -> TokenUsage | None:
        """See `Completion`. Thoughts have the price of replies."""
        usage = self.usage_metadata
        if usage is None:
            return None
        # The server leaves it out where nothing was cached.
        cached = min(usage.cached_content_token_count or 0, usage.prompt_token_count)
        written = usage.candidates_token_count + usage.thoughts_token_count
        return TokenUsage(usage.prompt_token_count, written, cached)

    @property
    def thinking(self) -> str | None:
        """See `Completion`."""
        return "".join(part.text for part in self._parts if part.thought) or None

    def text(self, where: str) -> str:
        """See `Completion`."""
        if not self.candidates:
            blocked = self.prompt_feedback.block_reason is not None
            why = _FILTERED if blocked else "; is it a model that generates text?"
            raise ModelError(f"{where} gives no text{why}")
        reason = self.candidates[0].finish_reason or ""
        text = "".join(part.text for part in self._parts if not part.thought)
        if text or reason == "STOP" or (self.thinking is not None and reason == "MAX_TOKENS"):
            return text
        why = _FILTERED if reason in _BLOCKED else _WHY.get(reason, "; see its log")
        raise ModelError(f"{where} gives no text{why}")

    @property
    def _parts(self) -> list[_Part]:
        return self.candidates[0].content.parts if self.candidates else []


def read_content(where: str, content: bytes) -> GeneratedContent:
    """Parse a server's reply.

    Raises:
        ModelError: the body is not of the Gemini API.
    """
    return decode_reply(where, content, GeneratedContent, "generated content")


def to_contents(name: str, turns: Sequence[Turn], frames: EncodedFrames) -> dict[str, Any]:
    """Return the fields `systemInstruction` and `contents` of a conversation, with texts and frames
    in order.

    Raises:
        DataError: a frame cannot be read.
        ModelError: a turn other than the user's has a frame.
    """
    fields: dict[str, Any] = {"contents": []}
    for turn in turns:
        require_user_frames(name, turn)
        parts = [_part(part, frames) for part in turn.parts]
        if turn.role == "system":
            earlier = fields.get("systemInstruction", {"parts": []})["parts"]
            fields["systemInstruction"] = {"parts": [*earlier, *parts]}
        else:
            role = "model" if turn.role == "assistant" else "user"
            fields["contents"].append({"role": role, "parts": parts})
    return fields


def _part(part: str | FrameRef | Video, frames: EncodedFrames) -> dict[str, Any]:
    if isinstance(part, str):
        return {"text": part}
    assert not isinstance(part, Video)  # `check_turns` refuses it
    return {"inlineData": {"mimeType": frames.media_type, "data": frames.base64(part)}}
