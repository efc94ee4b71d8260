"""How fast a run goes: units a second, what is left, and how much of the contexts was found in a cache."""

from infthor_eval.runs import NOTHING, Usage

__all__ = ["Pace", "duration"]

_LEAST_S = 10.0  # between two lines
_MOST_S = 60.0  # after which there is one in any case
_STEP = 0.05  # of all units, after which there is one


class Pace:
    """Counts what is done, and says it.

    Attributes:
        n_found: units that an earlier run had done.
        n_made: units that this one has.
    """

    def __init__(self, n_units: int, now: float, n_found: int = 0) -> None:
        """Begin.

        Args:
            n_units: of the run.
            now: seconds, of any clock that goes evenly.
            n_found: units that an earlier run had done.
        """
        self._n_units = n_units
        self._usage: Usage = NOTHING
        self._begun = self._told_at = now
        self.n_found, self.n_made = n_found, 0
        self._told_of = n_found

    def count(self, usage: Usage, resumed: bool, now: float) -> None:
        """A unit is there; what an earlier run had done says nothing of the pace."""
        if resumed:
            self.n_found += 1
            self._begun = now if not self.n_made else self._begun
        else:
            self.n_made += 1
            self._usage = Usage.total((self._usage, usage))

    def speed(self, now: float) -> str:
        """How fast it goes: `1.3 a second, 83 % of tokens cached`; empty where nothing tells."""
        rate = self._rate(now)
        if rate is None:
            return ""
        cached = "" if self._usage.hit_rate is None else f", {100 * self._usage.hit_rate:.0f} % of tokens cached"
        return f"{f'{rate:.1f} a second' if rate >= 1 else f'{1 / rate:.1f} s each'}{cached}"

    def line(self, now: float) -> str:
        """All of it: `37 of 147 (25 %), 2 min left, 1.3 a second, 83 % of tokens cached`."""
        n_done, rate = self._n_done, self._rate(now)
        place = f"{n_done:,} of {self._n_units:,} ({100 * n_done / self._n_units:.0f} %)"
        if rate is None:
            return place
        return f"{place}, {duration((self._n_units - n_done) / rate)} left, {self.speed(now)}"

    def is_due(self, now: float) -> bool:
        """Whether a line is to be written: not too soon after the last, then at each step, and now and then anyway.

        At the end there is none: what came of it is told then.
        """
        if self._n_done >= self._n_units:
            return False
        since = now - self._told_at
        stepped = self._n_done - self._told_of >= _STEP * self._n_units
        due = since >= _MOST_S or (since >= _LEAST_S and stepped)
        if due:
            self._told_at, self._told_of = now, self._n_done
        return due

    @property
    def _n_done(self) -> int:
        return self.n_found + self.n_made

    def _rate(self, now: float) -> float | None:
        """Units a second; None where none was made yet."""
        seconds = now - self._begun
        return self.n_made / seconds if self.n_made and seconds > 0 else None


def duration(seconds: float) -> str:
    """A time in one unit: `1.5 s`, `12 min`, `3.0 h`."""
    if seconds < 120:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
