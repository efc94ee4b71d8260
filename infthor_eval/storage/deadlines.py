"""Time limits of code that is not ours, in whatever it waits or computes.

The one way to limit the time of somebody's code in this process: chat templates, policies behind a
server, memories, scorers, judges. `limits` has the limits in force, `docs/running.md` a table.
"""

import contextlib
import ctypes
import math
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import cached_property
from types import FrameType
from typing import ClassVar

from infthor_eval.storage.limits import Limit

_AGAIN_S = 1.0  # after which code that catches everything is interrupted once more
_SOON_S = 0.001  # after which code that is between two contexts is looked at again


class _LateError(BaseException):
    """Raised within the code that is late; each clock has a class of its own."""

    clock: ClassVar["_Clock"]


class _Clock:
    """Interrupts one thread when its time is up, and again as long as that does not end the code.

    In the main thread a signal does, so that it also ends waiting for a socket, a lock or a
    process. Signals reach no other thread: there the interpreter raises the error as soon as it
    runs the code again, and waiting itself needs a limit of its own.
    """

    def __init__(self, seconds: float) -> None:
        self.thread = threading.get_ident()
        self._is_main = threading.current_thread() is threading.main_thread()
        self._left = seconds  # while it stands still
        self._deadline = math.inf
        self._again = 0.0
        self._is_over = False
        self._is_interrupting = False
        self.has_interrupted = False

    @cached_property
    def late(self) -> type[_LateError]:
        """The class of this clock's error, which the interpreter wants instead of an instance."""
        return type("_LateError", (_LateError,), {"clock": self})

    @property
    def is_late(self) -> bool:
        """Whether the time is up and the code still runs."""
        return not self._is_over and self._deadline <= time.monotonic()

    @property
    def due(self) -> float:
        """When it is to interrupt next, in monotonic seconds."""
        return max(self._deadline, self._again)

    def go_on(self) -> None:
        """Count, for the first time or again."""
        self._deadline = time.monotonic() + self._left
        _WATCHER.watch(self)

    def stand_still(self) -> None:
        """Do not count what comes."""
        self._left, self._deadline = self._deadline - time.monotonic(), math.inf

    def end(self) -> None:
        """Interrupt nothing any more."""
        self._is_over = True
        _WATCHER.forget(self)
        while self._is_interrupting:  # of another thread, which is done at once
            time.sleep(0)
        if not self._is_main and self.has_interrupted:
            _raise_in(self.thread, None)

    def interrupt(self) -> None:
        """Interrupt the code, unless it has ended; never afterwards."""
        self._is_interrupting = True  # before it is asked whether the code has ended: see `end`
        if self.is_late:
            self._again = time.monotonic() + _AGAIN_S
            if self._is_main:
                signal.pthread_kill(self.thread, signal.SIGALRM)
            elif _is_between(sys._current_frames().get(self.thread)):
                self._again = time.monotonic() + _SOON_S
            else:
                self.has_interrupted = True
                _raise_in(self.thread, self.late)
        self._is_interrupting = False

    def interrupt_here(self, frame: FrameType | None) -> None:
        """Interrupt the code of the main thread, in the handler of the signal."""
        if _is_between(frame):
            self._again = time.monotonic() + _SOON_S
            _WATCHER.watch(self)
            return
        self.has_interrupted = True
        raise self.late


class _Watcher:
    """One thread for all clocks of the process: a thread for each would cost 200 µs a call.

    It sleeps until the first of them is due, and is woken by none that is due later: calls that end
    in time cost it nothing. There is no lock, as an interruption would leave it taken; what each
    line does is one step for the other threads.
    """

    def __init__(self) -> None:
        self._clocks: dict[int, _Clock] = {}
        self._wakes = math.inf  # when it looks again by itself
        self._woken: queue.SimpleQueue[None] = queue.SimpleQueue()
        self._starting = threading.Lock()
        self._is_running = False

    def watch(self, clock: _Clock) -> None:
        """Interrupt a clock's code when it is due."""
        if not self._is_running:
            self._start()
        self._clocks[id(clock)] = clock
        if clock.due < self._wakes:
            self._woken.put(None)

    def forget(self, clock: _Clock) -> None:
        """Leave a clock alone."""
        self._clocks.pop(id(clock), None)

    def _start(self) -> None:
        with self._starting:
            if not self._is_running:
                self._is_running = True
                threading.Thread(target=self._run, name="time limits", daemon=True).start()

    def _run(self) -> None:
        while True:
            # Who begins from here on is not among those looked at, and wakes it.
            self._wakes = math.inf
            for clock in list(self._clocks.values()):
                if clock.due <= time.monotonic():
                    clock.interrupt()
            wakes = min((clock.due for clock in list(self._clocks.values())), default=math.inf)
            self._wakes = wakes
            left = None if wakes == math.inf else max(0.0, wakes - time.monotonic())
            with suppress(queue.Empty):
                self._woken.get(timeout=left)


_WATCHER = _Watcher()
_CLOCKS: dict[int, list[_Clock]] = {}  # those that run, by thread, the innermost last


def _watch_anew() -> None:
    """Begin without the watcher's thread, which a fork does not copy."""
    global _WATCHER  # noqa: PLW0603 - of the new process
    _WATCHER = _Watcher()


os.register_at_fork(after_in_child=_watch_anew)


@contextmanager
def limit_time(seconds: float, error: Exception) -> Iterator[None]:
    """Stop the code in the context when it takes longer, whatever it does, and raise an error.

    Limits may be nested; the outermost that is late ends all within.

    Args:
        seconds: wall time.
        error: the error to raise.

    Raises:
        Exception: `error`.
    """
    clock = _Clock(seconds)
    clocks = _CLOCKS.setdefault(clock.thread, [])
    try:
        with _handled(clocks):
            clocks.append(clock)
            clock.go_on()
            try:
                yield
            finally:
                clock.end()
    except _LateError as late:
        clock.end()  # if it was late just then
        if late.clock is not clock:
            raise
        raise error from None
    except Exception as failure:
        if not clock.has_interrupted:
            raise
        raise error from failure  # code in between has made another error of the interruption
    finally:
        with suppress(ValueError):
            clocks.remove(clock)
        if not clocks:
            _CLOCKS.pop(clock.thread, None)


def limit_by(limit: Limit, problem: str, error: type[Exception]) -> AbstractContextManager[None]:
    """Stop the code in the context by a limit that people can raise; see `limit_time`.

    Args:
        limit: the limit, in seconds.
        problem: the code and what it fails to do, for the message.
        error: class of the error to raise.
    """
    seconds = limit.value
    late = f"{problem}: it is not done after {seconds} s; {limit.hint}"
    return limit_time(seconds, error(late))


@contextmanager
def not_counted() -> Iterator[None]:
    """Stop the clocks of this thread meanwhile: what somebody's code asks of us is not its time."""
    clocks = list(_CLOCKS.get(threading.get_ident(), ()))
    for clock in clocks:
        clock.stand_still()
    try:
        yield
    finally:
        for clock in clocks:
            clock.go_on()


@contextmanager
def _handled(clocks: list[_Clock]) -> Iterator[None]:
    """Handle the signal of the clocks of the main thread, for the first of them."""
    if clocks or threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(_number: int, frame: FrameType | None) -> None:
        late = next((one for one in clocks if one.is_late), None)
        if late is not None:
            late.interrupt_here(frame)

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGALRM, before)


def _is_between(frame: FrameType | None) -> bool:
    """Return whether a thread is on its way into a context or out of it, where nobody would catch
    what is raised."""
    return frame is not None and any(
        frame.f_globals is names for names in (globals(), vars(contextlib))
    )


def _raise_in(thread: int, error: type[BaseException] | None) -> None:
    """Raise an error in another thread as soon as it runs Python code; None takes one back."""
    ctypes.pythonapi.PyThreadState_SetAsyncExc(
        ctypes.c_ulong(thread), None if error is None else ctypes.py_object(error)
    )
