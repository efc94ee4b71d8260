"""A limit on the computing time of code that comes with a checkpoint (chat templates)."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["OutOfTimeError", "limit_time"]


class OutOfTimeError(Exception):
    """Code computed for longer than allowed."""


@contextmanager
def limit_time(seconds: int) -> Iterator[None]:
    """Stop code that computes for longer; only in the main thread, because signals reach no other.

    The processor time of the process counts, so the limit does not depend on the load of the
    machine.

    Raises:
        OutOfTimeError: the time is used up.
    """

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise OutOfTimeError(f"it is not done after {seconds} s")

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)
