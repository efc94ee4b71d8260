"""Batches at a server of Anthropic's: one request with all of them, and one list of results.

The form is that of `POST /messages/batches`, `GET /messages/batches`, and `GET
/messages/batches/ID/results`. A batch has no name of ours there, so that a lost one is told by its
time, its size, and in the end by the names of its requests.
"""

from collections.abc import Collection, Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import ModelError
from model_adapters.served.batches.service import Batch, BatchReply, BatchStatus
from model_adapters.served.batches.transfer import TRANSFER_S, Transfer
from model_adapters.served.endpoint import Endpoint, is_transient
from model_adapters.served.wire import Call

__all__ = ["AnthropicBatches"]

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
    id: str
    processing_status: str
    created_at: datetime
    request_counts: _Counts = _Counts()
    cancel_initiated_at: str | None = None


class _Page(msgspec.Struct, frozen=True):
    data: list[_Batch]
    has_more: bool = False
    last_id: str | None = None


class _Error(msgspec.Struct, frozen=True):
    type: str = ""


class _Errored(msgspec.Struct, frozen=True):
    error: _Error = _Error()


class _Result(msgspec.Struct, frozen=True):
    type: str
    message: msgspec.Raw = msgspec.Raw(b"null")
    error: msgspec.Raw = msgspec.Raw(b"{}")


class _Line(msgspec.Struct, frozen=True):
    custom_id: str
    result: _Result


class AnthropicBatches:
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
        return self._transfer.submit(call, _Batch, lambda: self._find(batch, others)).id

    def find(self, batch: Batch, others: Collection[str]) -> str | None:
        """See `BatchService`."""
        found = self._find(batch, others)
        return None if found is None else found.id

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
        found = []
        for line in self._lines(str(batch.server_id)):
            request = batch.request_of(line.custom_id)
            if request is not None:
                found.append(_reply(request, line.result))
        return found

    def _lines(self, server_id: str) -> Iterator[_Line]:
        return self._transfer.lines(f"/messages/batches/{server_id}/results", _Line)

    def _find(self, batch: Batch, others: Collection[str]) -> _Batch | None:
        """Return a batch that may be ours, or is; None if the server has none.

        If one that may be ours is not, it has none of our requests in the end, and they are asked.

        Raises:
            ModelError: there are several that may be ours, as they have not ended.
        """
        candidates = []
        for found in self._since(batch.prepared_at - _CLOCKS_S):
            if found.id in others or found.request_counts.total != len(batch.ids):
                continue
            if found.processing_status != "ended":
                candidates.append(found)
            elif any(batch.request_of(line.custom_id) for line in self._lines(found.id)):
                return found
        if len(candidates) > 1:
            raise ModelError(
                f"{self._transfer.where} has {len(candidates)} batches that may be this run's; run "
                "the same command again when they have ended"
            )
        return candidates[0] if candidates else None

    def _since(self, begin: float) -> Iterator[_Batch]:
        """Yield the server's batches, the latest first, back to a time."""
        after = ""
        while True:
            page = self._transfer.page(f"/messages/batches?limit={_PAGE}{after}", _Page)
            for found in page.data:
                if found.created_at.timestamp() < begin:
                    return
                yield found
            if not page.has_more or not page.last_id:
                return
            after = f"&after_id={page.last_id}"


def _reply(request: str, result: _Result) -> BatchReply:
    if result.type == "succeeded":
        return BatchReply(request, 200, bytes(result.message).decode())
    if result.type == "errored":
        error = msgspec.json.decode(result.error, type=_Errored).error
        status = _STATUS.get(error.type, 500)
        return BatchReply(request, status, bytes(result.error).decode(), is_transient(status))
    return BatchReply(request, 0, f"it is {result.type}", result.type == "expired")
