"""How fast work goes: units a second, time left, share of tokens from a cache."""

_MIN_INTERVAL_S = 10.0  # between two lines
_MAX_INTERVAL_S = 60.0  # after which there is a line in any case
_STEP = 0.05  # of all units, after which there is a line


class Pace:
    """Counts units and measures how fast they come.

    Attributes:
        n_resumed: units that an earlier run had done.
        n_new: units done by this run.
    """

    def __init__(self, n_units: int, now: float, n_resumed: int = 0) -> None:
        """Start counting.

        Args:
            n_units: units in all.
            now: seconds, of any monotonic clock.
            n_resumed: units that an earlier run had done.
        """
        self._n_units = n_units
        self._weights: tuple[float, float, float] | None = None
        self._context_tokens = self._cached_tokens = 0
        self._started_at = self._last_line_at = now
        self.n_resumed = n_resumed
        self.n_new = 0
        self._n_done_at_last_line = n_resumed

    def count(self, resumed: bool, now: float, context: int = 0, cached: int = 0) -> None:
        """Count a unit.

        Args:
            resumed: whether an earlier run had done it; such a unit says nothing about the pace.
            now: seconds.
            context: tokens of its requests.
            cached: tokens of these that were not encoded again.
        """
        if resumed:
            self.n_resumed += 1
            self._started_at = now if not self.n_new else self._started_at
        else:
            self.n_new += 1
            self._context_tokens += context
            self._cached_tokens += cached

    def weigh(self, done: float, left: float, now: float) -> None:
        """Take what was done by now, and what is left, where units differ in what they take."""
        self._weights = done, left, now

    def go_on(self, n_new: int, n_units: int) -> None:
        """Take how many units this run has done so far, and how many there are by now in all."""
        self.n_new, self._n_units = n_new, n_units

    def speed(self, now: float) -> str:
        """Return the pace, `1.3 a second, 83 % of tokens cached`; empty before a new unit."""
        rate = self._rate(now)
        if rate is None:
            return ""
        speed = f"{rate:.1f} a second" if rate >= 1 else f"{1 / rate:.1f} s each"
        if not self._context_tokens:
            return speed
        return f"{speed}, {100 * self._cached_tokens / self._context_tokens:.0f} % of tokens cached"

    def line(self, now: float) -> str:
        """Return all of it: `37 of 147 (25 %), 2 min left, 1.3 a second, 83 % of tokens cached`."""
        n_done = self._n_done
        position = f"{n_done:,} of {self._n_units:,} ({100 * n_done / self._n_units:.0f} %)"
        rest = self.rest(now)
        return f"{position}, {rest}" if rest else position

    def rest(self, now: float) -> str:
        """Return time left and pace, `2 min left, 1.3 a second`; no time before it can be told."""
        done, left, at = self._weights or (self.n_new, self._n_units - self._n_done, now)
        if not done or self._rate(now) is None:
            return self.speed(now)
        seconds = (at - self._started_at) * left / done - (now - at)
        return f"{format_duration(max(0.0, seconds))} left, {self.speed(now)}"

    def is_due(self, now: float) -> bool:
        """Return whether to print a line now.

        Lines come at every step of 5 %, but at most one in 10 seconds and at least one a minute.
        There is none at the end, where results follow.
        """
        if self._n_done >= self._n_units:
            return False
        elapsed = now - self._last_line_at
        has_step = self._n_done - self._n_done_at_last_line >= _STEP * self._n_units
        due = elapsed >= _MAX_INTERVAL_S or (elapsed >= _MIN_INTERVAL_S and has_step)
        if due:
            self._last_line_at = now
            self._n_done_at_last_line = self._n_done
        return due

    @property
    def _n_done(self) -> int:
        return self.n_resumed + self.n_new

    def _rate(self, now: float) -> float | None:
        """Units a second; None before the first new one."""
        seconds = now - self._started_at
        return self.n_new / seconds if self.n_new and seconds > 0 else None


def format_duration(seconds: float) -> str:
    """Return a time in one unit: `1.5 s`, `12 min`, `3.0 h`."""
    if seconds < 120:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
