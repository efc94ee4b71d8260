"""Ctrl-C in the midst of a run: the first one lets the unit in hand end, the second stops at once."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType

__all__ = ["Stop", "stopped_by_sigint"]


class Stop:
    """Whether somebody asked a run to stop; what asks all the time calls it."""

    def __init__(self) -> None:
        self.asked = False
        self.begun = False  # before the first unit there is nothing to finish

    def __call__(self) -> bool:
        """Whether to stop."""
        return self.asked


@contextlib.contextmanager
def stopped_by_sigint(say: Callable[[str], None]) -> Iterator[Stop]:
    """SIGINT asks to stop, where the run has begun; again, or before that, it stops at once.

    Args:
        say: is told what happens, a line.
    """
    stop = Stop()

    def ask(_number: int, _frame: FrameType | None) -> None:
        if stop.asked or not stop.begun:
            raise KeyboardInterrupt
        stop.asked = True
        say("stopping after the unit in hand; press Ctrl-C again to stop at once")

    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = signal.signal(signal.SIGINT, ask)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)
