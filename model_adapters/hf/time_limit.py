"""A limit on what a piece of code that comes with a checkpoint may compute."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["OutOfTimeError", "computing_at_most"]


class OutOfTimeError(Exception):
    """It computed for longer than it may."""


@contextmanager
def computing_at_most(seconds: int) -> Iterator[None]:
    """Stop what computes for longer, in the main thread; in others there is no way to.

    It is the process's own computing that counts, so a busy machine stops nothing.

    Raises:
        OutOfTimeError: it did.
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
