"""Ctrl-C during a run: the first one finishes the present unit, the second stops at once.

Python tells nobody of one while a call computes: a signal's handler runs in the main thread,
between two instructions of Python, and a step of training or a long prompt on a CPU is one call of
many seconds.
"""

import contextlib
import math
import select
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import FrameType

_ANSWER_S = 1.0
_SAME_S = 0.1  # a forked process reports the same press; a person takes longer for two


class _Handled:
    """How often Ctrl-C was handled: signals are the process's, so there is one of these."""

    n = 0


@dataclass
class Stop:
    """Whether a run is to stop; the driver calls it before each unit.

    Attributes:
        is_requested: whether Ctrl-C was pressed.
        has_begun: whether units are being done; before that there is nothing to finish.
    """

    is_requested: bool = False
    has_begun: bool = False

    def __call__(self) -> bool:
        """Return whether to stop."""
        return self.is_requested


@contextlib.contextmanager
def handle_signal(number: int, handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Handle a signal within the context, if this is the main thread: others may not."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def handle(received: int, frame: FrameType | None) -> None:
        _Handled.n += received == signal.SIGINT
        handler(received, frame)

    before = signal.signal(number, handle)
    try:
        yield
    finally:
        signal.signal(number, before)


@contextlib.contextmanager
def stop_on_sigint(print_note: Callable[[str], None]) -> Iterator[Stop]:
    """Request a stop at the first SIGINT; interrupt at the second, or before the first unit."""
    stop = Stop()

    def request_stop(_number: int, _frame: FrameType | None) -> None:
        if stop.is_requested or not stop.has_begun:
            raise KeyboardInterrupt
        stop.is_requested = True
        print_note("stopping after the present unit; press Ctrl-C again to stop at once")

    with handle_signal(signal.SIGINT, request_stop):
        yield stop


@contextlib.contextmanager
def answer_ctrl_c(warn: Callable[[], None], end: Callable[[], None]) -> Iterator[None]:
    """Answer each Ctrl-C within a second, if this is the main thread.

    Args:
        warn: called if a press has not been handled after a second.
        end: called if it was pressed twice in the same calculation; it ends the process.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    reading, writing = socket.socketpair()
    writing.setblocking(False)
    thread = threading.Thread(
        target=_Presses(reading, warn, end).answer, name="ctrl-c", daemon=True
    )
    thread.start()
    before = signal.set_wakeup_fd(writing.fileno(), warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        writing.close()  # which ends the thread
        thread.join()
        reading.close()


class _Presses:
    """The presses that have not been handled yet."""

    def __init__(
        self, signals: socket.socket, warn: Callable[[], None], end: Callable[[], None]
    ) -> None:
        self._signals = signals
        self._warn = warn
        self._end = end
        self._times: list[float] = []
        self._last = -math.inf
        self._n_settled = _Handled.n
        self._is_warned = False

    def answer(self) -> None:
        """Answer presses until the other end of the socket is closed."""
        while True:
            is_pressed = bool(select.select([self._signals], [], [], self._patience())[0])
            self._settle()  # earlier presses before the new one, which comes after them
            if is_pressed and not self._take():
                return
            self._settle()
            if self._patience() == 0:
                if len(self._times) > 1:
                    self._end()
                    return
                self._warn()
                self._is_warned = True

    def _patience(self) -> float | None:
        """Return the seconds until the first press must be answered; None to wait for another."""
        if not self._times or (self._is_warned and len(self._times) == 1):
            return None
        return max(0.0, self._times[0] + _ANSWER_S - time.monotonic())

    def _settle(self) -> None:
        """Forget the presses that were handled; Python handles several in one call once."""
        n_new = _Handled.n - self._n_settled
        if self._times and n_new:
            self._n_settled += min(n_new, len(self._times))
            self._times.clear()
            self._is_warned = False

    def _take(self) -> bool:
        """Note a press; return False at the end."""
        numbers = self._signals.recv(64)
        if signal.SIGINT in numbers:
            now = time.monotonic()
            if now - self._last > _SAME_S:
                self._times.append(now)
            self._last = now
        return bool(numbers)
