"""In which order, and how many at a time, groups are done."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from queue import Empty, SimpleQueue
from threading import Event, Thread
from typing import Any, TypeVar

from infthor_eval.runs.records import Unit, UnitRecord
from infthor_eval.runs.suite import Group

__all__ = ["run_groups"]

P = TypeVar("P")
U = TypeVar("U", bound=Unit[Any])


def run_groups(
    groups: Sequence[Group[U]], do: Callable[[Group[U]], Iterable[UnitRecord[P]]], max_in_flight: int
) -> Iterator[UnitRecord[P]]:
    """The records of all groups, as they come.

    Args:
        groups: in the order in which they are begun.
        do: does one group; called from several threads where several are in flight.
        max_in_flight: how many groups are done at the same time.
    """
    if max_in_flight == 1 or len(groups) <= 1:
        for group in groups:
            yield from do(group)
    else:
        yield from _in_threads(groups, do, min(max_in_flight, len(groups)))


def _in_threads(
    groups: Sequence[Group[U]], do: Callable[[Group[U]], Iterable[UnitRecord[P]]], n_threads: int
) -> Iterator[UnitRecord[P]]:
    waiting: SimpleQueue[Group[U]] = SimpleQueue()
    for group in groups:
        waiting.put(group)
    made: SimpleQueue[UnitRecord[P] | BaseException | None] = SimpleQueue()  # None: a thread has ended
    stop = Event()
    threads = [Thread(target=_work, args=(waiting, do, made, stop), daemon=True) for _ in range(n_threads)]
    for thread in threads:
        thread.start()
    running = n_threads
    try:
        while running:
            item = made.get()
            if isinstance(item, BaseException):
                raise item
            if item is None:
                running -= 1
            else:
                yield item
    finally:
        stop.set()


def _work(
    waiting: "SimpleQueue[Group[U]]",
    do: Callable[[Group[U]], Iterable[UnitRecord[P]]],
    made: "SimpleQueue[UnitRecord[P] | BaseException | None]",
    stop: Event,
) -> None:
    try:
        while (group := _next(waiting)) is not None and not stop.is_set():
            for record in do(group):
                made.put(record)
                if stop.is_set():
                    return
    except BaseException as error:  # noqa: BLE001 - raised again in the thread that waits for the records
        made.put(error)
    else:
        made.put(None)


def _next(waiting: "SimpleQueue[Group[U]]") -> Group[U] | None:
    """The next group; None where there is none. Not by asking first: another thread may take the last one meanwhile."""
    try:
        return waiting.get_nowait()
    except Empty:
        return None
