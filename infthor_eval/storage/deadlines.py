"""Time limits of code that is not ours, in whatever it waits or computes.

The one way to limit the time of somebody's code in this process: chat templates, policies behind a
server, memories, scorers, judges. `limits` has the limits in force, `docs/running.md` a table.
"""

import ctypes
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import ClassVar

__all__ = ["limit_time", "not_counted"]

_AGAIN_S = 1.0  # after which code that catches everything is interrupted once more


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
        self.late = type("_LateError", (_LateError,), {"clock": self})
        self.thread = threading.get_ident()
        self._is_main = threading.current_thread() is threading.main_thread()
        self._left = seconds
        self._changed = threading.Condition()
        self._since: float | None = time.monotonic()  # None while it stands still
        self._is_over = False
        self.has_interrupted = False
        self._watcher = threading.Thread(target=self._watch, name="time limit", daemon=True)

    @property
    def is_late(self) -> bool:
        """Whether the time is up and the code still runs."""
        return not self._is_over and self._since is not None and self._remaining() <= 0

    def start(self) -> None:
        """Begin to count."""
        self._watcher.start()

    def stand_still(self) -> None:
        """Do not count what comes."""
        with self._changed:
            self._left, self._since = self._remaining(), None
            self._changed.notify()

    def go_on(self) -> None:
        """Count again."""
        with self._changed:
            self._since = time.monotonic()
            self._changed.notify()

    def end(self) -> None:
        """Interrupt nothing any more."""
        self._is_over = True
        # An interruption may arrive in the middle of this, with the lock in hand.
        if self._changed.acquire(timeout=_AGAIN_S):
            self._changed.notify()
            self._changed.release()
        if not self._is_main:
            _raise_in(self.thread, None)

    def _remaining(self) -> float:
        return self._left if self._since is None else self._left - (time.monotonic() - self._since)

    def _watch(self) -> None:
        with self._changed:
            while not self._is_over:
                if self.is_late:
                    self._interrupt()
                    self._changed.wait(_AGAIN_S)
                else:
                    self._changed.wait(None if self._since is None else self._remaining())

    def _interrupt(self) -> None:
        self.has_interrupted = True
        if self._is_main:
            signal.pthread_kill(self.thread, signal.SIGALRM)
        else:
            _raise_in(self.thread, self.late)


_CLOCKS: dict[int, list[_Clock]] = {}  # those that run, by thread, the innermost last


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
            clock.start()
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

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        late = next((one for one in clocks if one.is_late), None)
        if late is not None:
            raise late.late

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGALRM, before)


def _raise_in(thread: int, error: type[BaseException] | None) -> None:
    """Raise an error in another thread as soon as it runs Python code; None takes one back."""
    ctypes.pythonapi.PyThreadState_SetAsyncExc(
        ctypes.c_ulong(thread), None if error is None else ctypes.py_object(error)
    )
