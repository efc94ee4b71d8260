"""Ctrl-C during a run: the first one finishes the present unit, the second stops at once."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import FrameType


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


def n_handled() -> int:
    """Return how often Ctrl-C was handled in this process."""
    return _Handled.n


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
