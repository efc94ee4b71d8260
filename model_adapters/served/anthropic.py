"""Anthropic's messages: requests, replies, which may be anything, and batches.

A batch is one request with all of them, and one list of results; the form is that of `POST
/messages/batches`, `GET /messages/batches`, and `GET /messages/batches/ID/results`. A batch has no
name of ours there, so that a lost one is told by its time, its size, and in the end by the names of
its requests.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from model_adapters.protocols import Decoding, Turn
from model_adapters.served.batches.service import Batch, BatchReply, BatchStatus
from model_adapters.served.batches.transfer import TRANSFER_S, ServerId, Transfer
from model_adapters.served.completion import TokenUsage, decode_reply, read_error, read_usage
from model_adapters.served.endpoint import Endpoint, is_transient
from model_adapters.served.frames import EncodedFrames, require_user_frames
from model_adapters.served.options import AnthropicOptions
from model_adapters.served.wire import Call, StatusError

_VERSION = "2023-06-01"
_HOTTEST = 1.0
_WHY = {
    "max_tokens": ": the token limit was reached before any text; give --max-thinking-tokens N",
    "refusal": ": the server's classifiers stopped it; change the question",
    "tool_use": ": it calls a tool, though none was offered; use a server without tools",
    "model_context_window_exceeded": ": the context is too long; use fewer frames",
}
_PAGE = 100
_CLOCKS_S = 3600  # by which the server's clock may be behind ours


_STATUS = {  # of errors, by their type; it is that of the same error of a single request
    "invalid_request_error": 400,
    "authentication_error": 401,
    "billing_error": 402,
    "permission_error": 403,
    "not_found_error": 404,
    "request_too_large": 413,
    "rate_limit_error": 429,
    "api_error": 500,
    "timeout_error": 504,
    "overloaded_error": 529,
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


def _to_messages(
    name: str, turns: Sequence[Turn], frames: EncodedFrames, cache: dict[str, str] | None
) -> dict[str, Any]:
    """Return the fields `system` and `messages` of a conversation, with texts and frames in order.

    `cache` is put at the last frame: what is before the question is the same for all questions on a
    trajectory, and for all steps of an episode.
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


class _Counts(msgspec.Struct, frozen=True):
    processing: int = 0
    succeeded: int = 0
    errored: int = 0
    canceled: int = 0
    expired: int = 0

    @property
    def total(self) -> int:
        return self.processing + self.succeeded + self.errored + self.canceled + self.expired


class _Batch(msgspec.Struct, frozen=True):
    id: ServerId
    processing_status: str
    created_at: str = ""
    request_counts: _Counts = _Counts()
    cancel_initiated_at: str | None = None

    def is_since(self, begin: float) -> bool:
        """Return whether it was made after a time; what has no time in words may have been."""
        try:
            return datetime.fromisoformat(self.created_at).timestamp() >= begin
        except (ValueError, OverflowError):
            return True


class _Page(msgspec.Struct, frozen=True):
    data: list[_Batch]
    has_more: bool = False
    last_id: ServerId | None = None


class _Error(msgspec.Struct, frozen=True):
    type: str = ""


class _Errored(msgspec.Struct, frozen=True):
    error: _Error = _Error()


class _Result(msgspec.Struct, frozen=True):
    type: str
    message: msgspec.Raw = msgspec.Raw(b"null")
    error: msgspec.Raw = msgspec.Raw(b"{}")


class _Line(msgspec.Struct, frozen=True):
    result: _Result


class _AnthropicBatches:
    """See `BatchService`."""

    most_requests = 100_000
    most_bytes = 256 * 10**6

    def __init__(self, endpoint: Endpoint) -> None:
        self._transfer = Transfer(endpoint)

    def line(self, custom_id: str, request: dict[str, Any]) -> bytes:
        """See `BatchService`."""
        return msgspec.json.encode({"custom_id": custom_id, "params": request})

    def submit(self, batch: Batch, path: Path, others: Collection[str]) -> str:
        """See `BatchService`."""
        call = Call(
            path="/messages/batches",
            content=b'{"requests":[' + b",".join(path.read_bytes().splitlines()) + b"]}",
            headers={"Content-Type": "application/json"},
            timeout_s=TRANSFER_S,
        )
        made = self._transfer.submit(call, _Batch, lambda: self.find(batch, others))
        return made if isinstance(made, str) else made.id

    def status(self, batch: Batch) -> BatchStatus:
        """See `BatchService`."""
        call = Call(method="GET", path=f"/messages/batches/{batch.server_id}")
        found = self._transfer.read(call, _Batch, "a batch")
        if found.processing_status != "ended":
            return BatchStatus("running")
        # Who cancelled it does not want what is left to be asked at once.
        is_cancelled = found.cancel_initiated_at is not None
        reason = "the batch is cancelled" if is_cancelled else ""
        return BatchStatus("ended", reason, again=not is_cancelled)

    def replies(self, batch: Batch, status: BatchStatus) -> Sequence[BatchReply]:
        """See `BatchService`."""
        return list(self._replies(batch, str(batch.server_id)))

    def _replies(self, batch: Batch, server_id: str) -> Iterator[BatchReply]:
        path = f"/messages/batches/{server_id}/results"
        return self._transfer.replies(batch, path, _Line, _reply)

    def find(self, batch: Batch, others: Collection[str]) -> str | None:
        """See `BatchService`; of those that may be ours, too.

        If one that may be ours is not, it has none of our requests in the end, and they are asked.
        """
        candidates = []
        for found in self._since(batch.prepared_at - _CLOCKS_S):
            if found.id in others or found.request_counts.total != len(batch.ids):
                continue
            if found.processing_status != "ended":
                candidates.append(found)
            elif any(self._replies(batch, found.id)):
                return found.id
        if len(candidates) > 1:
            raise ModelError(
                f"{self._transfer.where} has {len(candidates)} batches that may be this run's; run "
                "the same command again when they have ended"
            )
        return candidates[0].id if candidates else None

    def _since(self, begin: float) -> Iterator[_Batch]:
        """Yield the server's batches, the latest first, back to a time."""
        for page in self._transfer.pages(f"/messages/batches?limit={_PAGE}", _Page, _after):
            recent = [found for found in page.data if found.is_since(begin)]
            yield from recent
            if not recent:
                return


def _after(page: _Page) -> str:
    return f"&after_id={page.last_id}" if page.has_more and page.last_id else ""


def _reply(request: str, line: _Line) -> BatchReply:
    result = line.result
    if result.type == "succeeded":
        return BatchReply(request, 200, bytes(result.message).decode())
    if result.type == "errored":
        told = decode_reply("it", bytes(result.error), _Errored, "an error")
        status = _STATUS.get(told.error.type, 500)
        return BatchReply(request, status, bytes(result.error).decode(), is_transient(status))
    return BatchReply(request, 0, f"it is {result.type}", result.type == "expired")


class AnthropicDialect:
    """The dialect of Anthropic's messages; see `Dialect`."""

    path = "/messages"
    hint = "check model and the options of requests (send_temperature, send_stop, prompt_cache)"
    guides = False

    def __init__(self, name: str, options: AnthropicOptions) -> None:
        self._name = name
        self._options = options
        self._frames = EncodedFrames(options.image_format)

    def headers(self, key: str | None) -> Mapping[str, str]:
        """See `Dialect`."""
        return {"anthropic-version": _VERSION} | ({} if key is None else {"x-api-key": key})

    def request(self, turns: Sequence[Turn], decoding: Decoding) -> dict[str, Any]:
        """See `Dialect`. There is neither a seed nor a penalty in this dialect."""
        options = self._options
        cache = {"type": "ephemeral"} if options.prompt_cache != "off" else None
        if cache is not None and options.prompt_cache != "5m":
            cache["ttl"] = options.prompt_cache
        request: dict[str, Any] = {
            "model": options.model,
            "max_tokens": decoding.max_new_tokens,
            **_to_messages(self._name, turns, self._frames, cache),
        }
        if options.send_temperature:
            if decoding.temperature > _HOTTEST:
                raise ModelError(f"{self._name} takes temperatures up to {_HOTTEST:g}; lower it")
            request["temperature"] = decoding.temperature
            if not decoding.greedy and decoding.top_p < 1:
                request["top_p"] = decoding.top_p
        # Those of white space alone are refused.
        stop = [text for text in decoding.stop if text.strip()]
        if options.send_stop and stop:
            request["stop_sequences"] = stop
        return request

    def read(self, where: str, content: bytes) -> Message:
        """See `Dialect`."""
        return decode_reply(where, content, Message, "a message")

    def batch_service(self, endpoint: Endpoint) -> _AnthropicBatches:
        """See `Dialect`."""
        return _AnthropicBatches(endpoint)
