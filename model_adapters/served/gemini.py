"""The Gemini API: requests, replies, which may be anything, and batches.

A batch is a file of requests, a batch, a file of replies; the form is that of `POST
/upload/.../files` (resumable), `POST /models/M:batchGenerateContent`, `GET /batches` and `GET
/download/.../FILE:download`.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import quote, urlsplit

import msgspec

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from model_adapters.protocols import Decoding, Turn
from model_adapters.served.batches.service import Batch, BatchReply, BatchStatus
from model_adapters.served.batches.transfer import LARGEST, TRANSFER_S, ServerId, Transfer
from model_adapters.served.completion import TokenUsage, decode_reply, read_error, read_usage
from model_adapters.served.endpoint import Endpoint, is_transient
from model_adapters.served.frames import EncodedFrames, require_user_frames
from model_adapters.served.options import GeminiOptions
from model_adapters.served.wire import Call, StatusError

_MOST_STOPS = 5  # stop strings that the server accepts
_SEEDS = 2**31
_WHY = {
    "MAX_TOKENS": ": the token limit was reached before any text; give --max-thinking-tokens N",
    "MALFORMED_FUNCTION_CALL": ": it calls a tool, though none was offered; use another model",
}
_BLOCKED = ("SAFETY", "RECITATION", "BLOCKLIST", "PROHIBITED_CONTENT", "SPII", "IMAGE_SAFETY")
_FILTERED = ": the server's content filter blocked it; change the question"
_PAGE = 100
_STATUS = {1: 499, 3: 400, 4: 504, 5: 404, 7: 403, 8: 429, 9: 400, 13: 500, 14: 503, 16: 401}


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


def _to_contents(name: str, turns: Sequence[Turn], frames: EncodedFrames) -> dict[str, Any]:
    """Return the fields `systemInstruction` and `contents` of a conversation, with texts and frames
    in order.
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


class _Error(msgspec.Struct, frozen=True):
    code: int = 13
    message: str = ""

    @property
    def status(self) -> int:
        """The status as in HTTP; codes are those of gRPC."""
        return self.code if self.code >= 100 else _STATUS.get(self.code, 500)


class _Output(msgspec.Struct, frozen=True, rename="camel"):
    responses_file: ServerId | None = None


class _Metadata(msgspec.Struct, frozen=True, rename="camel"):
    display_name: str = ""
    state: str = ""
    output: _Output | None = None


class _Operation(msgspec.Struct, frozen=True):
    name: ServerId
    metadata: _Metadata = _Metadata()
    error: _Error | None = None
    response: msgspec.Raw = msgspec.Raw(b"null")

    @property
    def state(self) -> str:
        """The state, without its prefix, which is not the same in all versions."""
        return self.metadata.state.rpartition("STATE_")[2]


class _Page(msgspec.Struct, frozen=True, rename="camel"):
    operations: list[_Operation] = []
    next_page_token: Annotated[str, msgspec.Meta(max_length=2000)] = ""


class _File(msgspec.Struct, frozen=True):
    name: ServerId


class _Uploaded(msgspec.Struct, frozen=True):
    file: _File


class _Line(msgspec.Struct, frozen=True):
    response: msgspec.Raw = msgspec.Raw(b"null")
    error: _Error | None = None


class _GeminiBatches:
    """See `BatchService`."""

    most_requests = 200_000
    most_bytes = 2 * 10**9

    def __init__(self, endpoint: Endpoint, model: str) -> None:
        self._transfer = Transfer(endpoint)
        self._model = model
        parts = urlsplit(endpoint.where)
        self._host = f"{parts.scheme}://{parts.netloc}"
        self._version = parts.path

    def line(self, custom_id: str, request: dict[str, Any]) -> bytes:
        """See `BatchService`."""
        return msgspec.json.encode({"key": custom_id, "request": request})

    def submit(self, batch: Batch, path: Path, others: Collection[str]) -> str:
        """See `BatchService`."""
        file = self._upload(batch, path)
        request = {"displayName": batch.name, "inputConfig": {"fileName": file.name}}
        call = Call(
            path=f"/models/{self._model}:batchGenerateContent",
            content=msgspec.json.encode({"batch": request}),
            headers={"Content-Type": "application/json"},
        )
        made = self._transfer.submit(call, _Operation, lambda: self.find(batch, others))
        return made if isinstance(made, str) else made.name

    def status(self, batch: Batch) -> BatchStatus:
        """See `BatchService`."""
        call = Call(method="GET", path=f"/{batch.server_id}", largest=LARGEST)
        found = self._transfer.read(call, _Operation, "a batch")
        if found.state in ("PENDING", "RUNNING", "UNSPECIFIED", ""):
            return BatchStatus("running")
        error = found.error or _Error()
        if found.state == "FAILED":
            reason = error.message or "it gives no reason"
            return BatchStatus("refused", reason, busy=error.status == 429)
        reason = "" if found.state == "SUCCEEDED" else f"the batch is {found.state.lower()}"
        output = found.metadata.output or _Output()
        if output.responses_file is None and bytes(found.response) != b"null":
            output = decode_reply(self._transfer.where, bytes(found.response), _Output, "a batch")
        places = (output.responses_file,) if output.responses_file else ()
        return BatchStatus("ended", reason, again=found.state != "CANCELLED", places=places)

    def replies(self, batch: Batch, status: BatchStatus) -> Sequence[BatchReply]:
        """See `BatchService`."""
        address = f"{self._host}/download{self._version}/{{}}:download?alt=media"
        return [
            reply
            for place in status.places
            for reply in self._transfer.replies(batch, address.format(place), _Line, _reply)
        ]

    def _upload(self, batch: Batch, path: Path) -> _File:
        kind = "application/jsonl"
        begin = Call(
            path=f"{self._host}/upload{self._version}/files",
            content=msgspec.json.encode({"file": {"displayName": batch.name}}),
            headers={
                "Content-Type": "application/json",
                "X-Goog-Upload-Protocol": "resumable",
                "X-Goog-Upload-Command": "start",
                "X-Goog-Upload-Header-Content-Length": str(path.stat().st_size),
                "X-Goog-Upload-Header-Content-Type": kind,
            },
        )
        place = self._transfer.send(begin).headers.get("x-goog-upload-url", "")
        if not place.startswith(f"{self._host}/"):
            raise ModelError(  # it would be sent the key
                f"{self._transfer.where} gives no address of its own for an upload; check base_url"
            )
        send = Call(
            path=place,
            content=path,
            headers={"X-Goog-Upload-Offset": "0", "X-Goog-Upload-Command": "upload, finalize"},
            timeout_s=TRANSFER_S,
        )
        return self._transfer.read(send, _Uploaded, "a file").file

    def find(self, batch: Batch, others: Collection[str]) -> str | None:
        """See `BatchService`; by our name of it."""
        for page in self._transfer.pages(f"/batches?pageSize={_PAGE}", _Page, _after):
            for found in page.operations:
                if found.metadata.display_name == batch.name:
                    return found.name
        return None


def _after(page: _Page) -> str:
    token = quote(page.next_page_token, safe="")
    return f"&pageToken={token}" if token else ""


def _reply(request: str, line: _Line) -> BatchReply:
    if line.error is None:
        return BatchReply(request, 200, bytes(line.response).decode())
    status = line.error.status
    return BatchReply(request, status, line.error.message, is_transient(status))


class GeminiDialect:
    """The dialect of the Gemini API; see `Dialect`."""

    hint = "check model and the options of requests (send_temperature, send_stop, send_seed)"
    guides = False

    def __init__(self, name: str, options: GeminiOptions) -> None:
        self._name = name
        self._options = options
        self._frames = EncodedFrames(options.image_format)
        self._model = quote(options.model.removeprefix("models/"), safe="")
        self.path = f"/models/{self._model}:generateContent"

    def headers(self, key: str | None) -> Mapping[str, str]:
        """See `Dialect`."""
        return {} if key is None else {"x-goog-api-key": key}

    def request(self, turns: Sequence[Turn], decoding: Decoding) -> dict[str, Any]:
        """See `Dialect`. There is no penalty in this dialect."""
        options = self._options
        config: dict[str, Any] = {"maxOutputTokens": decoding.max_new_tokens}
        if options.send_temperature:
            config["temperature"] = decoding.temperature
            if not decoding.greedy:
                config["topP"] = decoding.top_p
        if options.send_seed and not decoding.greedy:
            config["seed"] = decoding.seed % _SEEDS
        if options.send_stop and decoding.stop:
            config["stopSequences"] = list(decoding.stop[:_MOST_STOPS])
        return _to_contents(self._name, turns, self._frames) | {"generationConfig": config}

    def read(self, where: str, content: bytes) -> GeneratedContent:
        """See `Dialect`."""
        return decode_reply(where, content, GeneratedContent, "generated content")

    def batch_service(self, endpoint: Endpoint) -> _GeminiBatches:
        """See `Dialect`."""
        return _GeminiBatches(endpoint, self._model)
