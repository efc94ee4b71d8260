"""Where a question waits for its answer: a run's thread asks, the page's threads answer."""

import itertools
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from model_adapters.protocols import Decoding, Notice, Turn

# seconds between two looks at signals: conditions wait without, and Ctrl-C must end a run at once
_WAKE_S = 0.2


class ScreenClock:
    """Counts the seconds in which at least one page shows something."""

    def __init__(self) -> None:
        self._pages: set[str] = set()
        self._before = 0.0  # seconds of the times that are over
        self._since: float | None = None  # monotonic time from which it is shown without a break
        self._is_shown_once = False

    @property
    def seconds(self) -> float | None:
        """Seconds so far; None if no page has reported that it was shown."""
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


class StaleError(Exception):
    """An answer to a question that has been answered, or is no longer asked."""


@dataclass(frozen=True)
class Inquiry:
    """What is put before a person: the turns that a model would be given, the decoding, what is
    told beside, and which unit of the run it belongs to (from 1, and of how many; None where that
    is not known)."""

    turns: tuple[Turn, ...]
    decoding: Decoding
    notice: Notice
    position: tuple[int, int] | None = None


@dataclass(frozen=True)
class Answer:
    """A person's answer, the number of different frames that were looked at, and the seconds for
    which the question was on the screen; None if no page has told that it was."""

    text: str
    n_watched: int
    seconds: float | None


@dataclass(frozen=True)
class Question:
    """What is asked; `number` counts from 1, and `clock` the time for which it is on a screen."""

    number: int
    inquiry: Inquiry
    clock: ScreenClock = field(default_factory=ScreenClock)


class Desk:
    """One question at a time. Each change has a number, so that a page can wait for the next.

    Attributes:
        question: what is asked now; None between two questions.
        version: number of changes so far.
        n_answered: number of questions whose answers the run has kept so far.
        is_stopped: whether the person has stopped the run.
        is_closed: whether nothing will be asked any more.
    """

    def __init__(self) -> None:
        self.question: Question | None = None
        self.version = self.n_answered = 0
        self.is_closed = self.is_stopped = False
        self._changed = threading.Condition()
        self._numbers = itertools.count(1)
        self._answer: Answer | None = None
        self._has_readers = False
        self._n_reading = 0  # pages that wait for a change
        self._is_informed = self._is_awaited = False
        self._in_hand: int | None = None  # number of an answer that may not be on disk yet

    def ask(self, inquiry: Inquiry) -> Answer:
        """Put a question, and wait until it is answered.

        A run that asks again has kept the answer before: it writes a record to disk before it goes
        on. (The actions of a plan are one record, at the end of the plan.)

        Raises:
            KeyboardInterrupt: the person stops the run from the page.
        """
        with self._changed:
            self._settle(is_kept=True)
            number = next(self._numbers)
            self.question = Question(number, inquiry)
            self._answer = None
            self._change()
            try:
                while self._answer is None and not self.is_stopped:
                    self._changed.wait(_WAKE_S)
                if self._answer is None:
                    raise KeyboardInterrupt
                self._in_hand = number
                return self._answer
            finally:
                self.question = None
                self._change()

    def give(self, number: int, text: str, n_watched: int) -> None:
        """Answer the question of this number; see `Answer`.

        Raises:
            StaleError: it is not the one that is asked.
        """
        with self._changed:
            if self.question is None or self.question.number != number or self._answer is not None:
                raise StaleError
            self._answer = Answer(text, n_watched, self.question.clock.seconds)
            self._changed.notify_all()

    def report_screen(self, number: int, page: str, *, shows: bool) -> None:
        """Report whether a page shows the question of this number, frames and all.

        Reports on earlier questions are ignored.
        """
        with self._changed:
            if self.question is not None and self.question.number == number:
                clock = self.question.clock
                (clock.show if shows else clock.hide)(page)

    def wait_until_kept(self, number: int) -> bool:
        """Wait until the answer to a question is kept; False if the run has ended before."""
        with self._changed:
            self._changed.wait_for(lambda: self.n_answered >= number or self.is_closed)
            return self.n_answered >= number

    @contextmanager
    def reading(self) -> Iterator[None]:
        """Within this context a page waits for a change."""
        self._has_readers = True
        self._n_reading += 1
        try:
            yield
        finally:
            self._n_reading -= 1

    def report_closed(self) -> None:
        """Report that a page knows that the run is over."""
        with self._changed:
            self._is_informed = True
            self._changed.notify_all()

    def wait_until_informed(self, timeout_s: float, absent_s: float) -> None:
        """Wait until a page, if there is one, knows that the run is over.

        Args:
            timeout_s: seconds to wait at most for a page that waited for a change when it closed.
            absent_s: seconds to wait at most for one that did not, and may be closed itself.
        """
        with self._changed:
            self._changed.wait_for(
                lambda: self._is_informed or not self._has_readers,
                timeout_s if self._is_awaited else absent_s,
            )

    def stop(self) -> None:
        """Let the run end as Ctrl-C does: what is asked now stays unanswered, and is asked when the
        run goes on."""
        with self._changed:
            self.is_stopped = True
            self._change()

    def close(self, *, is_kept: bool = True) -> None:
        """Say that nothing will be asked any more, and whether the last answer is on disk."""
        with self._changed:
            self._settle(is_kept=is_kept)
            self.is_closed = True
            self._is_awaited = self._n_reading > 0
            self._change()

    def _settle(self, *, is_kept: bool) -> None:
        if self._in_hand is not None and is_kept:
            self.n_answered = self._in_hand
        self._in_hand = None

    def _change(self) -> None:
        self.version += 1
        self._changed.notify_all()
