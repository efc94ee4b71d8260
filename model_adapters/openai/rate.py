"""Rate limits."""

import time
from threading import Lock

__all__ = ["RateLimiter"]


class RateLimiter:
    """Grants a number of units per minute, evenly: after each grant, the next one waits until its
    time has passed.

    Servers count in their own windows, often shorter than a minute, so unused units are not saved
    up for a burst. Several threads may use it at once. A rate of None sets no limit.
    """

    def __init__(self, per_minute: float | None) -> None:
        self._seconds_per_unit = 0.0 if per_minute is None else 60.0 / per_minute
        self._free_at = 0.0  # on the clock of time.monotonic
        self._lock = Lock()

    def wait(self, amount: float = 1.0) -> None:
        """Wait for some units and take them."""
        with self._lock:
            now = time.monotonic()
            begin = max(now, self._free_at)
            self._free_at = begin + amount * self._seconds_per_unit
        if begin > now:
            time.sleep(begin - now)

    def take(self, amount: float) -> None:
        """Take units that were used already, without waiting; a negative amount gives units
        back."""
        with self._lock:
            self._free_at = max(time.monotonic(), self._free_at) + amount * self._seconds_per_unit
