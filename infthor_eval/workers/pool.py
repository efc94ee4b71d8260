"""Jobs shared out to workers: to whoever is free, again where a worker was lost, until all are done."""

import contextlib
from collections import Counter, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from threading import Condition, Lock, Thread
from typing import Any

from infthor_eval.errors import InfthorError
from infthor_eval.workers.link import Connect, Link, WorkerLostError

__all__ = ["Event", "GivenUp", "Lost", "Made", "Pool", "Withdrawn"]

_PATIENCE = 3  # losses in a row, of one job or of one worker's openings
_PARTING_S = 10.0  # for a thread whose worker is gone
_GLANCE_S = 0.2  # between two looks at whether to stop


@dataclass(frozen=True)
class Made:
    """A result of a job has come."""

    worker: int
    job: int
    result: Any


@dataclass(frozen=True)
class Lost:
    """A worker was lost at a job, which goes to another."""

    worker: int
    job: int
    reason: str


@dataclass(frozen=True)
class GivenUp:
    """A job that lost one worker after the other; what it had not given by now, it will not give."""

    worker: int
    job: int
    reason: str


@dataclass(frozen=True)
class Withdrawn:
    """A worker that cannot be opened (again); the others go on."""

    worker: int
    reason: str


@dataclass(frozen=True)
class _Ended:
    """A job has come to its end, or was left off."""

    job: int


Event = Made | Lost | GivenUp | Withdrawn


class _Board:
    """What is to be done: the jobs that wait, and whether any more will come."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[int, Callable[[], Any]]] = deque()
        self._changed = Condition()
        self._closed = False

    def add(self, job: int, make: Callable[[], Any], *, first: bool = False) -> None:
        with self._changed:
            (self._waiting.appendleft if first else self._waiting.append)((job, make))
            self._changed.notify()

    def clear(self) -> int:
        """Take all jobs down; how many there were."""
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
        """The next job, once there is one; None where none will come."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closed)
            return None if self._closed else self._waiting.popleft()


class Pool:
    """Workers, each behind a thread of the driver that gives it jobs.

    Workers open at their own time: who is ready works, who comes late (a node that joins a cluster) joins in.

    Args:
        connect: gives the link to a worker.
        count: how many workers.
        accept: is told each worker's greeting before it gets a job; an InfthorError that it raises ends the pool.
    """

    def __init__(self, connect: Connect, count: int, accept: Callable[[Any], None] = lambda _: None) -> None:
        self._links = {number: connect(number) for number in range(1, count + 1)}
        self._accept = accept
        self._board = _Board()
        self._events: SimpleQueue[Event | _Ended | Exception] = SimpleQueue()
        self._ready: SimpleQueue[Any] = SimpleQueue()  # greetings, and in the end why there are none
        self._patience = _PATIENCE
        self._losses: Counter[int] = Counter()  # by job, since it last got further
        self._furthest: Counter[int] = Counter()  # results, by job
        self._present = count
        self._leaving = Lock()
        self._threads = [
            Thread(target=self._attend, args=(number, link), daemon=True) for number, link in self._links.items()
        ]

    def open(self) -> Any:
        """Start all workers, and wait for the first of them; its greeting.

        Raises:
            InfthorError: none of them can be opened; why the last one cannot.
        """
        for thread in self._threads:
            thread.start()
        greeting = self._ready.get()
        if isinstance(greeting, Exception):
            raise greeting
        return greeting

    def run(
        self,
        jobs: int,
        order: Callable[[int], Any],
        should_stop: Callable[[], bool] = lambda: False,
        patience: int = _PATIENCE,
    ) -> Iterator[Event]:
        """Have jobs done; what happens, as it happens. Each job that is not stopped ends, or is given up.

        Args:
            jobs: how many; they are numbered from 0.
            order: what a worker is sent for a job, made when its turn comes.
            should_stop: is asked all the time; once it says so the jobs in hand are left off after their next
                result, and no further one is begun.
            patience: losses in a row of a job, without a further result between them, before it is given up.

        Raises:
            Exception: what a worker raised on a job, or why the last of them withdrew.
        """
        self._patience = patience
        self._losses.clear()
        self._furthest.clear()
        for job in range(jobs):
            self._board.add(job, lambda job=job: order(job))  # type: ignore[misc]
        left, stopped = jobs, False
        while left:
            if not stopped and should_stop():
                stopped = True
                left -= self._board.clear()
                self._stop_all()
                continue
            event = self._next_event()
            if isinstance(event, Lost):
                if stopped:
                    left -= 1
                else:
                    self._board.add(event.job, lambda job=event.job: order(job), first=True)  # type: ignore[misc]
            left -= isinstance(event, _Ended | GivenUp)
            if isinstance(event, Event):
                yield event

    def close(self) -> None:
        """End all workers, whatever they do."""
        self._board.close()
        for number, link in self._links.items():
            link.close()
            self._threads[number - 1].join(_PARTING_S)
            link.close()  # which the thread was about to open

    def _next_event(self) -> Event | _Ended | None:
        try:
            event = self._events.get(timeout=_GLANCE_S)
        except Empty:
            return None
        if isinstance(event, Exception):
            raise event
        return event

    def _stop_all(self) -> None:
        for link in self._links.values():
            with contextlib.suppress(WorkerLostError):  # its own thread finds that out, and says so
                link.stop()

    # -- a thread for each worker

    def _attend(self, number: int, link: Link) -> None:
        try:
            while self._opened(number, link) and not self._served(number, link):
                pass
        except Exception as error:  # noqa: BLE001 - raised again where the events are looked at
            self._ready.put(error)
            self._events.put(error)

    def _opened(self, number: int, link: Link) -> bool:
        """Whether a worker is ready for jobs; one that is lost while it opens is tried again."""
        reason: InfthorError = WorkerLostError("the pool is closed")
        for _ in range(_PATIENCE):
            if self._board.closed:
                return False
            try:
                greeting = link.open()
            except WorkerLostError as error:
                reason = error
            except InfthorError as error:
                reason = error
                break
            else:
                self._accept(greeting)
                self._ready.put(greeting)
                return True
        with self._leaving:
            self._present -= 1
            last = not self._present
        if last:
            raise reason
        self._events.put(Withdrawn(number, str(reason)))
        return False

    def _served(self, number: int, link: Link) -> bool:
        """Do jobs; whether there are no more, and not that the worker was lost."""
        while (taken := self._board.take()) is not None:
            job, make = taken
            try:
                for count, result in enumerate(link.do(make()), 1):
                    if count > self._furthest[job]:  # what it gave another worker before is no progress
                        self._furthest[job] = count
                        self._losses.pop(job, None)
                    self._events.put(Made(number, job, result))
            except WorkerLostError as error:
                self._losses[job] += 1
                given_up = self._losses[job] >= self._patience
                self._events.put((GivenUp if given_up else Lost)(number, job, str(error)))
                return False
            self._events.put(_Ended(job))
        return True
