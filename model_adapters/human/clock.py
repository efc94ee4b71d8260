"""How long something has been on a screen."""

import time


class ScreenClock:
    """Counts the seconds in which at least one page shows something."""

    def __init__(self) -> None:
        self._pages: set[str] = set()
        self._before = 0.0  # seconds of the times that are over
        self._since: float | None = None  # monotonic time from which it is shown without a break
        self._is_shown_once = False

    @property
    def seconds(self) -> float | None:
        """Seconds so far; None if no page has told that it was shown."""
        if not self._is_shown_once:
            return None
        return self._before + (0.0 if self._since is None else time.monotonic() - self._since)

    def show(self, page: str) -> None:
        """Take that a page shows it from now on; `page` tells pages apart."""
        self._pages.add(page)
        if self._since is None:
            self._since = time.monotonic()
            self._is_shown_once = True

    def hide(self, page: str) -> None:
        """Take that a page does not show it any more."""
        self._pages.discard(page)
        if self._since is not None and not self._pages:
            self._before += time.monotonic() - self._since
            self._since = None
