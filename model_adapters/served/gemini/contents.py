"""Conversations as contents of the Gemini API, and its replies, which may be anything."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import msgspec

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from model_adapters.protocols import Turn
from model_adapters.served.completion import TokenUsage, read_error, read_usage
from model_adapters.served.frames import EncodedFrames, require_user_frames
from model_adapters.served.wire import StatusError

_WHY = {
    "MAX_TOKENS": ": the token limit was reached before any text; give --max-thinking-tokens N",
    "MALFORMED_FUNCTION_CALL": ": it calls a tool, though none was offered; use another model",
}
_BLOCKED = ("SAFETY", "RECITATION", "BLOCKLIST", "PROHIBITED_CONTENT", "SPII", "IMAGE_SAFETY")
_FILTERED = ": the server's content filter blocked it; change the question"


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


class GeneratedContent(msgspec.Struct, frozen=True, rename="camel"):
    """A server's reply; see `Completion`."""

    candidates: list[_Candidate] = []
    prompt_feedback: _Feedback = _Feedback()
    usage_metadata: msgspec.Raw = msgspec.Raw(b"null")
    error: msgspec.Raw = msgspec.Raw(b"null")

    @property
    def failure(self) -> StatusError | None:
        """See `Completion`."""
        ending = self.candidates[0].finish_reason if self.candidates else None
        return read_error(ending, self.error)

    @property
    def tokens(self) -> TokenUsage | None:
        """See `Completion`. Thoughts have the price of replies; zeros are left out."""
        reply = ("candidatesTokenCount", "thoughtsTokenCount")
        cached = "cachedContentTokenCount"
        usage = read_usage(self.usage_metadata, ("promptTokenCount",), reply, cached, "")
        return usage and replace(usage, n_cached=usage.n_cached or 0)

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
