"""Ctrl-C while one call computes: Python runs no handler until the call has ended.

A signal's handler runs in the main thread, between two instructions of Python. A step of training
or a long prompt on a CPU is one call of many seconds.
"""

import contextlib
import math
import select
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator

from infthor_eval.cli.progress.stopping import n_handled

_ANSWER_S = 1.0
_SAME_S = 0.1  # a forked process reports the same press; a person takes longer for two


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
        self._n_settled = n_handled()
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
        n_new = n_handled() - self._n_settled
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
