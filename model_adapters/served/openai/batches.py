"""Batches at a server of OpenAI's: a file of requests, a batch, files of replies and of errors.

The form is that of `POST /files`, `POST /batches`, `GET /batches` and `GET /files/ID/content`.
"""

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import msgspec

from model_adapters.served.batches.service import Batch, BatchReply, BatchStatus
from model_adapters.served.batches.transfer import TRANSFER_S, ServerId, Transfer
from model_adapters.served.endpoint import Endpoint, is_transient
from model_adapters.served.wire import Call

_NAME = "infthor_eval_batch"  # key of our metadata
_PAGE = 100
_CLOCKS_S = 86_400  # by which the server's clock may be ahead of ours, or behind
_RUNNING = ("validating", "in_progress", "finalizing", "cancelling")
_BUSY = "token_limit_exceeded"
_CANCELLED = "batch_cancelled"


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


class OpenAIBatches:
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
