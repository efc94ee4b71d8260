"""Conversations as Anthropic's messages, and its replies, which may be anything."""

from collections.abc import Sequence
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
    "max_tokens": ": the token limit was reached before any text; give --max-thinking-tokens N",
    "refusal": ": the server's classifiers stopped it; change the question",
    "tool_use": ": it calls a tool, though none was offered; use a server without tools",
    "model_context_window_exceeded": ": the context is too long; use fewer frames",
}


class _Block(msgspec.Struct, frozen=True):
    type: str
    text: str = ""
    thinking: str = ""


class Message(msgspec.Struct, frozen=True):
    """A server's reply; see `Completion`."""

    type: str
    content: list[_Block] = []
    stop_reason: str | None = None
    usage: msgspec.Raw = msgspec.Raw(b"null")
    error: msgspec.Raw = msgspec.Raw(b"null")

    @property
    def failure(self) -> StatusError | None:
        """See `Completion`."""
        return read_error("error" if self.type == "error" else self.stop_reason, self.error)

    @property
    def tokens(self) -> TokenUsage | None:
        """See `Completion`. What is cached is not in the server's count of the input."""
        more = ("cache_read_input_tokens", "cache_creation_input_tokens")
        return read_usage(self.usage, ("input_tokens", *more), ("output_tokens",), *more)

    @property
    def thinking(self) -> str | None:
        """See `Completion`."""
        return "".join(block.thinking for block in self.content) or None

    def text(self, where: str) -> str:
        """See `Completion`."""
        text = "".join(block.text for block in self.content if block.type == "text")
        if text or self.stop_reason in ("end_turn", "stop_sequence"):
            return text
        if self.thinking is not None and self.stop_reason == "max_tokens":
            return ""
        raise ModelError(
            f"{where} gives no text{_WHY.get(self.stop_reason or '', '; see its log')}"
        )


def to_messages(
    name: str, turns: Sequence[Turn], frames: EncodedFrames, cache: dict[str, str] | None
) -> dict[str, Any]:
    """Return the fields `system` and `messages` of a conversation, with texts and frames in order.

    `cache` is put at the last frame: what is before the question is the same for all questions on a
    trajectory, and for all steps of an episode.

    Raises:
        DataError: a frame cannot be read.
        ModelError: a turn other than the user's has a frame.
    """
    fields: dict[str, Any] = {"messages": []}
    last_image: dict[str, Any] | None = None
    for turn in turns:
        require_user_frames(name, turn)
        blocks = [_block(part, frames) for part in turn.parts]
        last_image = next((it for it in reversed(blocks) if it["type"] == "image"), last_image)
        if turn.role == "system":
            fields["system"] = [*fields.get("system", []), *blocks]
        else:
            fields["messages"].append({"role": turn.role, "content": blocks})
    if cache is not None and last_image is not None:
        last_image["cache_control"] = cache
    return fields


def _block(part: str | FrameRef | Video, frames: EncodedFrames) -> dict[str, Any]:
    if isinstance(part, str):
        return {"type": "text", "text": part}
    assert not isinstance(part, Video)  # `check_turns` refuses it
    source = {"type": "base64", "media_type": frames.media_type, "data": frames.base64(part)}
    return {"type": "image", "source": source}
