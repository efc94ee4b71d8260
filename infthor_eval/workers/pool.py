"""Jobs done by several workers: each goes to a free worker, and to another if that is lost."""

import contextlib
from collections import Counter, deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from queue import Empty, SimpleQueue
from threading import Condition, Lock, Thread
from typing import Any

from infthor_eval.errors import InfthorError
from infthor_eval.workers.link import Connect, Link, WorkerLostError

_MAX_LOSSES = 3  # in a row, of one job or while one worker opens
_EXIT_WAIT_S = 10.0  # for the thread of a closed link
_STOP_CHECK_S = 0.2  # between two checks whether to stop


@dataclass(frozen=True)
class JobResult:
    """A result of a job has arrived."""

    worker: int
    job: int
    result: Any


@dataclass(frozen=True)
class WorkerLost:
    """A worker was lost at a job, which goes to another."""

    worker: int
    job: int
    reason: str


@dataclass(frozen=True)
class JobFailed:
    """A job lost worker after worker, and is given up; its results so far are valid."""

    worker: int
    job: int
    reason: str


@dataclass(frozen=True)
class WorkerWithdrawn:
    """A worker cannot be opened (again); the others go on."""

    worker: int
    reason: str


@dataclass(frozen=True)
class _JobEnded:
    """A job has ended, or was stopped."""

    job: int


Event = JobResult | WorkerLost | JobFailed | WorkerWithdrawn


class _JobQueue:
    """Waiting jobs, each with the function that creates what its worker is sent."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[int, Callable[[], Any]]] = deque()
        self._changed = Condition()
        self._closed = False

    def add(self, job: int, create: Callable[[], Any], *, first: bool = False) -> None:
        with self._changed:
            (self._waiting.appendleft if first else self._waiting.append)((job, create))
            self._changed.notify()

    def clear(self) -> int:
        """Remove all jobs; return their number."""
        with self._changed:
            n_waiting = len(self._waiting)
            self._waiting.clear()
            return n_waiting

    def close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    @property
    def closed(self) -> bool:
        return self._closed

    def take(self) -> tuple[int, Callable[[], Any]] | None:
        """Wait for the next job and return it; None once the queue is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closed)
            return None if self._closed else self._waiting.popleft()


class Pool:
    """Workers, each behind a thread of the driver that gives it jobs.

    Each worker opens at its own pace: one that is ready works, and one that comes late (a node that
    joins a cluster) joins in.

    Args:
        connect: returns the link to a worker.
        count: number of workers.
        accept: called with each worker's greeting before its first job; an InfthorError that it
            raises ends the pool.
    """

    def __init__(
        self, connect: Connect, count: int, accept: Callable[[Any], None] = lambda _: None
    ) -> None:
        self._links = {number: connect(number) for number in range(1, count + 1)}
        self._accept = accept
        self._jobs = _JobQueue()
        self._events: SimpleQueue[Event | _JobEnded | Exception] = SimpleQueue()
        # Greetings; an exception once no worker can be opened.
        self._ready: SimpleQueue[Any] = SimpleQueue()
        self._max_losses = _MAX_LOSSES
        self._losses: Counter[int] = Counter()  # by job, since its last new result
        self._n_results: Counter[int] = Counter()  # by job, most of all its workers
        self._n_present = count
        self._withdrawing = Lock()
        self._threads = [
            Thread(target=self._attend, args=(number, link), daemon=True)
            for number, link in self._links.items()
        ]

    def open(self) -> Any:
        """Start all workers, wait for the first of them, and return its greeting."""
        for thread in self._threads:
            thread.start()
        greeting = self._ready.get()
        if isinstance(greeting, Exception):
            raise greeting
        return greeting

    def run(
        self,
        n_jobs: int,
        create: Callable[[int], Any],
        should_stop: Callable[[], bool] = lambda: False,
        max_losses: int = _MAX_LOSSES,
    ) -> Iterator[Event]:
        """Have jobs done and yield what happens. Each job that is not stopped ends, or is given up.

        Args:
            n_jobs: number of jobs, which are numbered from 0.
            create: creates what a worker is sent for a job, when a worker is free for it.
            should_stop: asked all the time; once it returns True, the present jobs are stopped
                after their next result, and no further one is started.
            max_losses: losses in a row of a job, without a further result between them, before it
                is given up.

        Raises:
            Exception: a worker raised it on a job, or the last worker withdrew for this reason.
        """
        self._max_losses = max_losses
        self._losses.clear()
        self._n_results.clear()
        for job in range(n_jobs):
            self._jobs.add(job, lambda job=job: create(job))  # type: ignore[misc]
        n_left = n_jobs
        stopped = False
        while n_left:
            if not stopped and should_stop():
                stopped = True
                n_left -= self._jobs.clear()
                self._stop_all()
                continue
            event = self._next_event()
            if isinstance(event, WorkerLost):
                if stopped:
                    n_left -= 1
                else:
                    # First in the queue: its results so far are fresh in the journal, and its group
                    # is half done.
                    self._jobs.add(event.job, partial(create, event.job), first=True)
            n_left -= isinstance(event, _JobEnded | JobFailed)
            if isinstance(event, Event):
                yield event

    def close(self) -> None:
        """End all workers, whatever they are doing."""
        self._jobs.close()
        with ThreadPoolExecutor(len(self._links)) as closers:
            list(closers.map(self._close, self._links.values(), self._threads))

    @staticmethod
    def _close(link: Link, thread: Thread) -> None:
        link.close()
        thread.join(_EXIT_WAIT_S)
        link.close()  # again: the thread may have opened it in between

    def _next_event(self) -> Event | _JobEnded | None:
        try:
            event = self._events.get(timeout=_STOP_CHECK_S)
        except Empty:
            return None
        if isinstance(event, Exception):
            raise event
        return event

    def _stop_all(self) -> None:
        for link in self._links.values():
            with contextlib.suppress(WorkerLostError):  # its own thread notices and reports it
                link.stop()

    # -- a thread for each worker

    def _attend(self, number: int, link: Link) -> None:
        try:
            while self._open_worker(number, link) and not self._do_jobs(number, link):
                pass
        except Exception as error:  # noqa: BLE001 - raised again in the thread that waits
            self._ready.put(error)
            self._events.put(error)

    def _open_worker(self, number: int, link: Link) -> bool:
        """Open a worker, several times if lost meanwhile; return whether it is ready for jobs."""
        reason: InfthorError = WorkerLostError("the pool is closed")
        for _ in range(_MAX_LOSSES):
            if self._jobs.closed:
                return False
            try:
                greeting = link.open()
            except WorkerLostError as error:
                reason = error
            except InfthorError as error:
                # It says why it cannot be created: another try would end the same way.
                reason = error
                break
            else:
                self._accept(greeting)
                self._ready.put(greeting)
                return True
        with self._withdrawing:
            self._n_present -= 1
            is_last = not self._n_present
        if is_last:
            raise reason
        self._events.put(WorkerWithdrawn(number, str(reason)))
        return False

    def _do_jobs(self, number: int, link: Link) -> bool:
        """Have a worker do jobs; return True when none is left, False when it was lost."""
        while (taken := self._jobs.take()) is not None:
            job, create = taken
            try:
                for count, result in enumerate(link.do(create()), 1):
                    # Results that another worker gave before are no progress.
                    if count > self._n_results[job]:
                        self._n_results[job] = count
                        self._losses.pop(job, None)
                    self._events.put(JobResult(number, job, result))
            except WorkerLostError as error:
                self._losses[job] += 1
                is_given_up = self._losses[job] >= self._max_losses
                self._events.put(
                    (JobFailed if is_given_up else WorkerLost)(number, job, str(error))
                )
                return False
            self._events.put(_JobEnded(job))
        return True
