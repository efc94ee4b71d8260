"""OpenAI's chat completions: vLLM, SGLang, transformers, commercial servers.

Requests, replies, which may be anything and are parsed strictly, and batches: a file of requests, a
batch, files of replies and of errors. The form of these is that of `POST /files`, `POST /batches`,
`GET /batches` and `GET /files/ID/content`.
"""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from infthor_eval.storage.digests import fingerprint
from model_adapters.protocols import Decoding, Part, Turn
from model_adapters.served.batches.service import Batch, BatchReply, BatchStatus
from model_adapters.served.batches.transfer import TRANSFER_S, ServerId, Transfer
from model_adapters.served.completion import TokenUsage, decode_reply, read_error, read_usage
from model_adapters.served.endpoint import Endpoint, is_transient
from model_adapters.served.frames import EncodedFrames, require_user_frames
from model_adapters.served.options import OpenAIOptions
from model_adapters.served.wire import Call, StatusError

_MOST_STOPS = 4  # stop strings that servers accept
_SEEDS = 2**31  # servers accept seeds of few more bits
# By finish_reason. Unknown ones are not quoted, because a server may put any text there.
_FILTERED = ": the server's content filter blocked it; change the question"
_WHY = {
    "length": ": the token limit was reached before any text; give --max-thinking-tokens N",
    "content_filter": _FILTERED,
    "sensitive": _FILTERED,
    "tool_calls": ": it calls a tool, though none was offered; use a server without tools",
}
_NAME = "infthor_eval_batch"  # key of our metadata
_PAGE = 100
_CLOCKS_S = 86_400  # by which the server's clock may be ahead of ours, or behind
_RUNNING = ("validating", "in_progress", "finalizing", "cancelling")
_BUSY = "token_limit_exceeded"
_CANCELLED = "batch_cancelled"


def to_messages(
    name: str, turns: Sequence[Turn], frames: EncodedFrames, detail: str | None
) -> list[dict[str, Any]]:
    """Return a conversation's messages, with texts and frames in order; each frame has this
    `detail` unless it is None.
    """
    return [{"role": turn.role, "content": _content(name, turn, frames, detail)} for turn in turns]


def _content(
    name: str, turn: Turn, frames: EncodedFrames, detail: str | None
) -> str | list[dict[str, Any]]:
    # Some servers accept only a string in system turns.
    if all(isinstance(part, str) for part in turn.parts):
        return "".join(map(str, turn.parts))
    require_user_frames(name, turn)
    return [_part(part, frames, detail) for part in turn.parts]


def _part(part: Part, frames: EncodedFrames, detail: str | None) -> dict[str, Any]:
    if isinstance(part, str):
        return {"type": "text", "text": part}
    assert not isinstance(part, Video)  # `check_turns` refuses it
    image = {"url": frames.url(part)} | ({} if detail is None else {"detail": detail})
    return {"type": "image_url", "image_url": image}


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


class _File(msgspec.Struct, frozen=True):
    id: ServerId


class _Error(msgspec.Struct, frozen=True):
    code: str | None = None
    message: str | None = None

    @property
    def words(self) -> str:
        return " ".join(f"{self.code or ''} {self.message or ''}".split()) or "no reason"


class _Errors(msgspec.Struct, frozen=True):
    data: list[_Error] = []


class _Batch(msgspec.Struct, frozen=True):
    id: ServerId
    status: str
    created_at: float = 0.0
    output_file_id: ServerId | None = None
    error_file_id: ServerId | None = None
    errors: _Errors | None = None
    metadata: dict[str, Any] | None = None


class _Page(msgspec.Struct, frozen=True):
    data: list[_Batch]
    has_more: bool = False


class _Response(msgspec.Struct, frozen=True):
    status_code: int
    body: msgspec.Raw = msgspec.Raw(b"null")


class _Line(msgspec.Struct, frozen=True):
    response: _Response | None = None
    error: _Error | None = None


class _OpenAIBatches:
    """See `BatchService`."""

    most_requests = 50_000
    most_bytes = 200 * 10**6

    def __init__(self, endpoint: Endpoint) -> None:
        self._transfer = Transfer(endpoint)

    def line(self, custom_id: str, request: dict[str, Any]) -> bytes:
        """See `BatchService`."""
        line = {"custom_id": custom_id, "method": "POST", "url": "/v1/chat/completions"}
        return msgspec.json.encode(line | {"body": request})

    def submit(self, batch: Batch, path: Path, others: Collection[str]) -> str:
        """See `BatchService`."""
        file = self._upload(path)
        request = {
            "input_file_id": file.id,
            "endpoint": "/v1/chat/completions",
            "completion_window": "24h",
            "metadata": {_NAME: batch.name},
        }
        call = Call(
            path="/batches",
            content=msgspec.json.encode(request),
            headers={"Content-Type": "application/json"},
        )
        made = self._transfer.submit(call, _Batch, lambda: self.find(batch, others))
        return made if isinstance(made, str) else made.id

    def status(self, batch: Batch) -> BatchStatus:
        """See `BatchService`."""
        call = Call(method="GET", path=f"/batches/{batch.server_id}")
        found = self._transfer.read(call, _Batch, "a batch")
        if found.status in _RUNNING:
            return BatchStatus("running")
        errors = found.errors.data if found.errors is not None else []
        reason = "; ".join(error.words for error in errors[:3])
        if found.status == "failed":
            is_busy = any(error.code == _BUSY for error in errors)
            return BatchStatus("refused", reason or "it gives no reason", busy=is_busy)
        places = [place for place in (found.output_file_id, found.error_file_id) if place]
        # Who cancelled it does not want what is left to be asked at once.
        is_cancelled = found.status == "cancelled"
        reason = reason or ("" if found.status == "completed" else f"the batch is {found.status}")
        return BatchStatus("ended", reason, again=not is_cancelled, places=tuple(places))

    def replies(self, batch: Batch, status: BatchStatus) -> Sequence[BatchReply]:
        """See `BatchService`."""
        return [
            reply
            for place in status.places
            for reply in self._transfer.replies(batch, f"/files/{place}/content", _Line, _reply)
        ]

    def _upload(self, path: Path) -> _File:
        call = Call(path="/files", content=path, form={"purpose": "batch"}, timeout_s=TRANSFER_S)
        return self._transfer.read(call, _File, "a file")

    def find(self, batch: Batch, others: Collection[str]) -> str | None:
        """See `BatchService`; by our name of it, the latest first."""
        begin = batch.prepared_at - _CLOCKS_S
        for page in self._transfer.pages(f"/batches?limit={_PAGE}", _Page, _after):
            for found in page.data:
                if (found.metadata or {}).get(_NAME) == batch.name:
                    return found.id
            if all(found.created_at < begin for found in page.data):
                break
        return None


def _after(page: _Page) -> str:
    return f"&after={page.data[-1].id}" if page.has_more and page.data else ""


def _reply(request: str, line: _Line) -> BatchReply:
    response = line.response
    if response is not None:
        body = bytes(response.body).decode()
        return BatchReply(request, response.status_code, body, is_transient(response.status_code))
    error = line.error or _Error()
    return BatchReply(request, 0, error.words, error.code != _CANCELLED)


class OpenAIDialect:
    """The dialect of OpenAI's chat completions; see `Dialect`."""

    path = "/chat/completions"
    hint = (
        "check model and the options of requests (send_seed, send_temperature, send_stop, "
        "send_repetition_penalty, send_skip_special_tokens, max_tokens_field)"
    )

    def __init__(self, name: str, options: OpenAIOptions) -> None:
        self._name = name
        self._options = options
        self.guides = options.guided is not None
        self._frames = EncodedFrames(options.image_format)

    def headers(self, key: str | None) -> Mapping[str, str]:
        """See `Dialect`."""
        return {} if key is None else {"Authorization": f"Bearer {key}"}

    def request(self, turns: Sequence[Turn], decoding: Decoding) -> dict[str, Any]:
        """See `Dialect`."""
        options = self._options
        request: dict[str, Any] = {
            "model": options.model,
            "messages": to_messages(self._name, turns, self._frames, options.detail),
            options.max_tokens_field: decoding.max_new_tokens,
        }
        if options.send_temperature:
            request["temperature"] = decoding.temperature
            if not decoding.greedy:
                request["top_p"] = decoding.top_p
        if options.send_seed and not decoding.greedy:
            request["seed"] = decoding.seed % _SEEDS
        if options.send_prompt_cache_key:
            request["prompt_cache_key"] = _hash_of_frames(turns)
        if options.send_repetition_penalty and decoding.repetition_penalty is not None:
            request["repetition_penalty"] = decoding.repetition_penalty
        if decoding.choices:
            request["structured_outputs"] = {"choice": list(decoding.choices)}
        elif options.send_stop and decoding.stop:
            request["stop"] = list(decoding.stop[:_MOST_STOPS])
            if options.send_skip_special_tokens:
                request["skip_special_tokens"] = False
        return request

    def read(self, where: str, content: bytes) -> ChatCompletion:
        """See `Dialect`."""
        return decode_reply(where, content, ChatCompletion, "a chat completion")

    def batch_service(self, endpoint: Endpoint) -> _OpenAIBatches:
        """See `Dialect`."""
        return _OpenAIBatches(endpoint)


def _hash_of_frames(turns: Sequence[Turn]) -> str:
    """Return a key that requests on the same frames have in common."""
    parts = [part for turn in turns for part in turn.parts if isinstance(part, FrameRef)]
    return fingerprint({"frames": [frame.digest for frame in parts]})
