"""The protocol of a server that takes batches, and what is kept of a batch.

To add batches to a dialect: a class with the members of `BatchService`, and its line in
`batch_service` of the dialect.
"""

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any, Literal, Protocol

import msgspec
from msgspec.structs import replace

_MISSING = "the batch has ended without a line for it"
_CONTRADICTION = "it gives several that differ, and none counts"


class Batch(msgspec.Struct, omit_defaults=True):
    """A batch of ours.

    Attributes:
        name: its name, which no other batch of anybody has; the server knows it, too.
        ids: the requests in it.
        prepared_at: time when its file was complete, before it was submitted, in seconds since
            1970.
        server_id: the server's name of it; None until the server has taken it.
        ended: true once its replies are on disk.
    """

    name: str
    ids: list[str]
    prepared_at: float
    server_id: str | None = None
    ended: bool = False

    def request_of(self, custom_id: str) -> str | None:
        """Return which request a `custom_id` is of; None if it is of another batch."""
        request, _, name = custom_id.partition("-")
        return request if name == self.name else None


def custom_id(request: str, batch: str) -> str:
    """Return the server's name of a request: that of the request, then that of the batch."""
    return f"{request}-{batch}"


class BatchReply(msgspec.Struct, frozen=True, omit_defaults=True):
    """What became of a request in a batch.

    Attributes:
        id: the request.
        status: status of its reply, as in HTTP; 0 if it was not processed.
        content: body of its reply; or why it was not processed.
        again: true if it may be answered when it is asked again.
    """

    id: str
    status: int
    content: str
    again: bool = False

    @property
    def is_answered(self) -> bool:
        """True if there is a reply, which was paid for."""
        return self.status == 200


class BatchStatus(msgspec.Struct, frozen=True):
    """What a server says of a batch.

    Attributes:
        phase: `refused` if none of its requests was or will be processed.
        reason: why it was refused, or why some of its requests were not processed.
        again: true if requests that were not processed may be asked again without more ado.
        busy: true if it was refused for there being too many requests already.
        places: where its replies are.
    """

    phase: Literal["running", "ended", "refused"]
    reason: str = ""
    again: bool = True
    busy: bool = False
    places: tuple[str, ...] = ()


def one_each(batch: Batch, replies: Sequence[BatchReply], status: BatchStatus) -> list[BatchReply]:
    """Return one reply for each request of a batch; requests of others are left out. Of answers to
    one request that differ, nobody can tell which is to its question, so that it has none."""
    found: dict[str, BatchReply] = {}
    for reply in sorted(replies, key=lambda each: not each.is_answered):
        first = found.setdefault(reply.id, reply)
        if reply.is_answered and first != reply:
            found[reply.id] = BatchReply(reply.id, 0, _CONTRADICTION)
    missing = BatchReply("", 0, status.reason or _MISSING, status.again)
    return [found.get(each) or replace(missing, id=each) for each in batch.ids]


class BatchService(Protocol):
    """The part of a server that takes batches.

    Attributes:
        most_requests: most requests of a batch.
        most_bytes: most bytes of a batch's file.
    """

    most_requests: int
    most_bytes: int

    def line(self, custom_id: str, request: dict[str, Any]) -> bytes:
        """Return a request as a line of a batch's file, without the line's end."""

    def submit(self, batch: Batch, path: Path, others: Collection[str]) -> str:
        """Submit a batch from its file, and return the server's name of it; `others` are the names
        of this run's other batches.

        Raises:
            NoAnswerError: the server cannot be reached.
            ModelError: the server refuses it.
        """

    def find(self, batch: Batch, others: Collection[str]) -> str | None:
        """Return the server's name of a batch that was perhaps submitted; None if it is not there.

        Raises:
            NoAnswerError: the server cannot be reached.
            ModelError: it is not known yet.
        """

    def status(self, batch: Batch) -> BatchStatus:
        """Return what has become of a batch that was submitted.

        Raises:
            NoAnswerError: the server cannot be reached.
            ModelError: the server does not know it.
        """

    def replies(self, batch: Batch, status: BatchStatus) -> Sequence[BatchReply]:
        """Return the replies of a batch that has ended, in any order; some may be missing.

        Raises:
            NoAnswerError: the server cannot be reached.
            ModelError: what it gives is no list of replies.
        """
