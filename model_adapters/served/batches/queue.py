"""A run's requests in batches, so that none is asked twice, and none is lost."""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import Any, BinaryIO

from msgspec.structs import replace

from infthor_eval.errors import InfthorError, ModelError, NotAskedError, wrap_errors
from infthor_eval.storage.files import writing_hint
from model_adapters.served.batches.ledger import Ledger
from model_adapters.served.batches.service import (
    Batch,
    BatchReply,
    BatchService,
    custom_id,
    one_each,
)
from model_adapters.served.endpoint import NoAnswerError, is_transient
from model_adapters.served.wire import StatusError

_FIRST_POLL_S = 2.0  # pause between two looks at a server; it grows by half
_LONGEST_POLL_S = 120.0
_NAP_S = 0.1  # a pause ends so soon after the run is stopped
_LISTED_WITHIN_S = 30.0  # by then a batch that the server has is in its list
_MB = 10**6


@dataclass(frozen=True, kw_only=True)
class BatchRules:
    """How a run uses batches.

    Attributes:
        most_requests: most requests of a batch; None for the server's limit.
        most_mb: most megabytes of a batch; None for the server's limit.
        retries: repetitions of a request that was not processed.
        room: returns how many requests the caps allow now, None for any number; raises
            `NotAskedError` where they allow none.
        count: takes each reply that arrives, for the caps.
        failure: returns the error in the body of a reply, of status 0 if it has no reply at all.
        describe: returns status and body of a reply that is an error as one line.
        redact: returns a text without the key, which a server may repeat.
        where: the server, in messages.
    """

    most_requests: int | None
    most_mb: int | None
    retries: int
    room: Callable[[], int | None]
    count: Callable[[BatchReply], None]
    failure: Callable[[bytes], StatusError | None]
    describe: Callable[[int, bytes], str]
    redact: Callable[[str], str]
    where: str


@dataclass(frozen=True)
class BatchedReply:
    """The body of a reply.

    Attributes:
        content: the body.
        faults: a line for each earlier attempt.
        is_shared: true if an equal request was given the same reply before, which was paid for
            once.
    """

    content: bytes
    faults: tuple[str, ...]
    is_shared: bool


@dataclass
class _Draft:
    """A batch that is being collected: its requests are in the file already."""

    name: str
    file: BinaryIO
    ids: list[str] = field(default_factory=list)
    n_bytes: int = 0


class _TooLargeError(ModelError):
    """A request that no batch can hold."""


class BatchQueue:
    """Collects requests, submits a batch when it is full, waits for all, and gives the replies.

    A request is named by what it asks, so that equal requests of a run are one. What is in a batch
    is on disk before the batch is submitted; a batch whose name at the server was lost in between
    is found there by its own name. Requests that were not processed are collected once more.
    """

    def __init__(
        self,
        folder: Path,
        service: BatchService,
        rules: BatchRules,
        notify: Callable[[str], None],
        should_stop: Callable[[], bool],
    ) -> None:
        """Read the batches of earlier commands."""
        self._ledger = Ledger(folder)
        self._service = service
        self._rules = rules
        self._notify = notify
        self._should_stop = should_stop
        self._most_requests = min(
            service.most_requests, rules.most_requests or service.most_requests
        )
        most_mb = rules.most_mb
        self._most_bytes = min(service.most_bytes, (most_mb or service.most_bytes) * _MB)
        self._lock = Lock()
        self._is_collecting = False
        self._draft: _Draft | None = None
        self._fault: InfthorError | None = None  # of the server or the disk: nothing more is asked
        self._in_hand: set[str] = set()  # requests in the draft, or in batches that have not ended
        self._answered: dict[str, BatchReply] = {}
        self._failed: dict[str, list[BatchReply]] = {}  # attempts of this command, in order
        self._refused: dict[str, InfthorError] = {}  # cannot be asked, or not under the caps
        self._wanted: set[str] = set()
        self._given: set[str] = set()
        self._was_busy = False
        for batch in self._ledger.batches.values():
            if not batch.ended:
                self._in_hand.update(batch.ids)
                continue
            checked = map(self._checked, self._ledger.replies(batch))
            self._answered |= {reply.id: reply for reply in checked if reply.is_answered}

    @contextmanager
    def collecting(self) -> Iterator[None]:
        """Within this context requests are collected, and none is answered."""
        self._wanted.clear()
        self._refused.clear()
        for batch in self._unfinished:
            if batch.server_id is None:  # a command that was stopped may have submitted it, or not
                self._find_or_submit(batch)
        self._is_collecting = True
        try:
            yield
        finally:
            self._is_collecting = False

    def ask(self, request: str, make: Callable[[], dict[str, Any]]) -> BatchedReply:
        """Return the reply to a request, which is named by its hash; while requests are collected,
        put it into a batch unless it is in one.
        """
        with self._lock:
            if not self._is_collecting:
                return self._give(request)
            self._wanted.add(request)
            if self._fault is None and not (self._should_stop() or self._is_known(request)):
                self._collect(request, make)
        raise NotAskedError("not asked yet: it is collected for a batch")

    def fetch(self) -> bool:
        """Submit what was collected and wait for all batches; see `Batches.fetch`."""
        if self._fault is not None:
            raise self._fault
        n_answered = len(self._answered)
        self._was_busy = False
        self._submit_draft()
        self._wait()
        if self._should_stop():
            self._report_unfinished()
            return False
        again = [request for request in self._wanted if not self._is_known(request)]
        if again and self._was_busy and len(self._answered) == n_answered:
            raise ModelError(
                f"{self._rules.where} takes no further batch now; run the same command again "
                "later, or with a lower batch_requests"
            )
        if again:
            self._notify(f"{len(again)} request(s) were not processed, and are asked again")
        return bool(again)

    def close(self) -> None:
        """Drop what was collected and not submitted."""
        if self._draft is not None:
            self._draft.file.close()
            self._draft = None

    @property
    def _unfinished(self) -> list[Batch]:
        return [batch for batch in self._ledger.batches.values() if not batch.ended]

    @property
    def _known_there(self) -> set[str]:
        """The server's names of batches of this run."""
        return {batch.server_id for batch in self._ledger.batches.values() if batch.server_id}

    def _is_known(self, request: str) -> bool:
        """Return whether a request needs no asking: it is in hand, or it has its result."""
        if request in self._in_hand or request in self._answered or request in self._refused:
            return True
        failed = self._failed.get(request)
        return failed is not None and not (failed[-1].again and len(failed) <= self._rules.retries)

    def _give(self, request: str) -> BatchedReply:
        failed = self._failed.get(request, [])
        faults = tuple(f"{self._rules.where} {self._describe(reply)}" for reply in failed)
        reply = self._answered.get(request)
        if reply is not None:
            is_shared = request in self._given
            self._given.add(request)
            return BatchedReply(reply.content.encode(), faults, is_shared)
        if request in self._refused:
            raise self._refused[request]
        if not failed:
            raise NotAskedError("not asked: the run was stopped; run the same command again")
        attempts = f", in {len(failed)} attempts" if len(failed) > 1 else ""
        raise ModelError(f"{faults[-1]}{attempts}; run the same command again to ask again")

    def _describe(self, reply: BatchReply) -> str:
        if not reply.status:
            return f"gives no reply in a batch: {reply.content}"
        return f"in a batch {self._rules.describe(reply.status, reply.content.encode())}"

    def _collect(self, request: str, make: Callable[[], dict[str, Any]]) -> None:
        try:
            body = make()
        except InfthorError as error:  # of this request alone
            self._refused[request] = error
            return
        try:
            self._put(request, body)
        except (NotAskedError, _TooLargeError) as error:
            self._refused[request] = error
        except InfthorError as error:
            self._fault = error

    def _put(self, request: str, body: dict[str, Any]) -> None:
        room = self._room()
        draft = self._draft or self._begin_draft()
        line = self._line(draft, request, body)
        most = self._most_requests if room is None else min(self._most_requests, room)
        if draft.ids and not (
            len(draft.ids) < most and draft.n_bytes + len(line) <= self._most_bytes
        ):
            self._submit_draft()
            self._put(request, body)
            return
        with self._writes():
            draft.file.write(line)
        draft.ids.append(request)
        draft.n_bytes += len(line)
        self._in_hand.add(request)

    def _room(self) -> int | None:
        """Return how many requests the caps allow now; before, wait for what is at the server, as
        its cost decides."""
        room = self._rules.room()
        if room is not None and self._unfinished:
            self._wait()
            room = self._rules.room()
            if self._unfinished:
                raise NotAskedError("not asked: the run was stopped; run the same command again")
        return room

    def _line(self, draft: _Draft, request: str, body: dict[str, Any]) -> bytes:
        line = self._service.line(custom_id(request, draft.name), body) + b"\n"
        if len(line) > self._most_bytes:
            raise _TooLargeError(
                f"the request has {len(line) / _MB:.1f} MB, more than a batch may have "
                f"({self._most_bytes / _MB:g}); use fewer frames, or set image_format=jpeg"
            )
        return line

    def _begin_draft(self) -> _Draft:
        name = self._ledger.next_name()
        with self._writes():
            self._draft = _Draft(name, self._ledger.requests_file(name).open("wb"))
        return self._draft

    def _submit_draft(self) -> None:
        draft = self._draft
        if draft is None or not draft.ids:
            return
        with self._writes(), draft.file as file:
            file.flush()
            os.fsync(file.fileno())
        self._draft = None
        self._submit(self._ledger.prepare(draft.name, draft.ids))

    def _find_or_submit(self, batch: Batch) -> None:
        found = self._service.find(batch, self._known_there)
        if found is None:
            self._rest(_LISTED_WITHIN_S)  # the command before may have been stopped a moment ago
            if self._should_stop():
                return
            found = self._service.find(batch, self._known_there)
        if found is not None:
            self._ledger.note_submitted(batch, found)
            self._notify(f"batch {found}: {len(batch.ids)} request(s) found at the server")
        elif self._ledger.requests_file(batch.name).is_file():
            self._submit(batch)
        else:  # neither there nor here: its requests are asked anew
            self._end(batch, [])

    def _submit(self, batch: Batch) -> None:
        file = self._ledger.requests_file(batch.name)
        server_id = self._service.submit(batch, file, self._known_there)
        self._ledger.note_submitted(batch, server_id)
        self._notify(f"batch {server_id}: {len(batch.ids)} request(s) submitted")

    def _wait(self) -> None:
        """Wait until all batches have ended, or the run is stopped."""
        pause = _FIRST_POLL_S
        unreachable = False
        while self._unfinished and not self._should_stop():
            has_ended = False
            for batch in self._unfinished:
                try:
                    has_ended = self._look_after(batch) or has_ended
                except NoAnswerError as error:  # the batch goes on whether it is looked at or not
                    if not unreachable:
                        self._notify(f"{error}; the batches are looked after all the same")
                    unreachable = True
            if not has_ended:
                self._rest(pause)
                pause = min(1.5 * pause, _LONGEST_POLL_S)

    def _rest(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0 and not self._should_stop():
            time.sleep(min(left, _NAP_S))

    def _look_after(self, batch: Batch) -> bool:
        """Return whether a batch has ended; if so, keep its replies."""
        status = self._service.status(batch)
        if status.phase == "running":
            return False
        if status.phase == "refused":
            self._end(batch, [])
            self._was_busy = self._was_busy or status.busy
            if not status.busy:
                raise ModelError(
                    f"{self._rules.where} refuses batch {batch.server_id}: {status.reason}; fix "
                    "it, and run the same command again"
                )
            self._notify(f"batch {batch.server_id}: {status.reason}")
            return True
        given = one_each(batch, self._service.replies(batch, status), status)
        replies = [
            replace(reply, content=self._rules.redact(reply.content))
            for reply in map(self._checked, given)
        ]
        self._end(batch, replies)
        for paid in filter(lambda reply: reply.is_answered, given):  # whatever is in it
            self._rules.count(paid)
        for reply in replies:
            self._take(reply)
        n = sum(reply.is_answered for reply in replies)
        self._notify(
            f"batch {batch.server_id}: {n} answered, {len(replies) - n} not"
            + (f" ({status.reason})" if status.reason else "")
        )
        return True

    def _end(self, batch: Batch, replies: Sequence[BatchReply]) -> None:
        self._ledger.note_ended(batch, replies)
        self._in_hand.difference_update(batch.ids)

    def _take(self, reply: BatchReply) -> None:
        if reply.is_answered:
            self._answered[reply.id] = reply
        else:
            self._failed.setdefault(reply.id, []).append(reply)

    def _checked(self, reply: BatchReply) -> BatchReply:
        """Return a reply as its body has it: that of a success may hold an error, or be none."""
        failure = self._rules.failure(reply.content.encode()) if reply.is_answered else None
        if failure is None:
            return reply
        words = failure.content.decode()
        return BatchReply(reply.id, failure.status, words, is_transient(failure.status))

    def _report_unfinished(self) -> None:
        left = self._unfinished
        n = sum(len(batch.ids) for batch in left)
        if left:
            self._notify(
                f"{len(left)} batch(es) with {n} request(s) go on at the server; the same command "
                "fetches their replies"
            )

    def _writes(self) -> AbstractContextManager[None]:
        hint = writing_hint(" and run the same command again, which resumes it")
        return wrap_errors("the requests of a batch cannot be written", hint)
