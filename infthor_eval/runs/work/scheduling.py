"""Doing groups in order, several at a time where the subject takes several requests."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from queue import Empty, SimpleQueue
from threading import Event, Thread

from infthor_eval.runs.journals.records import Payload, SuiteUnit, UnitRecord
from infthor_eval.runs.suite import Group


def run_groups(
    groups: Sequence[Group[SuiteUnit]],
    do: Callable[[Group[SuiteUnit]], Iterable[UnitRecord[Payload]]],
    max_in_flight: int,
) -> Iterator[UnitRecord[Payload]]:
    """Yield all groups' records when they are there; several in flight have a thread each."""
    if max_in_flight == 1 or len(groups) <= 1:
        for group in groups:
            yield from do(group)
    else:
        yield from _in_threads(groups, do, min(max_in_flight, len(groups)))


def _in_threads(
    groups: Sequence[Group[SuiteUnit]],
    do: Callable[[Group[SuiteUnit]], Iterable[UnitRecord[Payload]]],
    n_threads: int,
) -> Iterator[UnitRecord[Payload]]:
    waiting: SimpleQueue[Group[SuiteUnit]] = SimpleQueue()
    for group in groups:
        waiting.put(group)
    # None: a thread has ended.
    results: SimpleQueue[UnitRecord[Payload] | BaseException | None] = SimpleQueue()
    stop = Event()
    threads = [
        Thread(target=_work, args=(waiting, do, results, stop), daemon=True)
        for _ in range(n_threads)
    ]
    for thread in threads:
        thread.start()
    running = n_threads
    try:
        while running:
            result = results.get()
            if isinstance(result, BaseException):
                raise result
            if result is None:
                running -= 1
            else:
                yield result
    finally:
        stop.set()


def _work(
    waiting: "SimpleQueue[Group[SuiteUnit]]",
    do: Callable[[Group[SuiteUnit]], Iterable[UnitRecord[Payload]]],
    results: "SimpleQueue[UnitRecord[Payload] | BaseException | None]",
    stop: Event,
) -> None:
    try:
        while (group := _next(waiting)) is not None and not stop.is_set():
            for record in do(group):
                results.put(record)
                if stop.is_set():
                    return
    except BaseException as error:  # noqa: BLE001 - raised again in the thread that waits
        results.put(error)
    else:
        results.put(None)


def _next(waiting: "SimpleQueue[Group[SuiteUnit]]") -> Group[SuiteUnit] | None:
    """Return the next group, or None if there is none."""
    try:  # rather than a check whether it is empty: another thread may take the last group after it
        return waiting.get_nowait()
    except Empty:
        return None
