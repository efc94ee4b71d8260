"""Keeping to so many a minute."""

import time
from threading import Lock

__all__ = ["RateLimiter"]


class RateLimiter:
    """Hands out so many a minute, evenly: whoever takes some has those behind it wait until they are made up for.

    Servers count in windows of their own, often shorter than a minute, so nothing is saved up for a burst. Several
    threads may use it at once.

    Args:
        per_minute: how many; None sets no limit.
    """

    def __init__(self, per_minute: float | None) -> None:
        self._seconds_each = 0.0 if per_minute is None else 60.0 / per_minute
        self._free_at = 0.0  # on the clock of time.monotonic
        self._lock = Lock()

    def wait(self, amount: float = 1.0) -> None:
        """Wait until some can be taken, and take them."""
        with self._lock:
            now = time.monotonic()
            begin = max(now, self._free_at)
            self._free_at = begin + amount * self._seconds_each
        if begin > now:
            time.sleep(begin - now)

    def take(self, amount: float) -> None:
        """Take some without waiting, as it turns out afterwards that they were; below 0 gives some back."""
        with self._lock:
            self._free_at = max(time.monotonic(), self._free_at) + amount * self._seconds_each
