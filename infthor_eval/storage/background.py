"""Work that one thread does behind another."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Any, Self

_WAITING = 8  # calls that may wait


class Background:
    """Calls one function after the other in a thread of its own.

    Leaving the context waits for all. What one raises is raised by a later `run`, or there.
    """

    def __init__(self, name: str) -> None:
        self._thread = ThreadPoolExecutor(1, name)
        self._waiting: deque[Future[None]] = deque()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self._thread.shutdown(cancel_futures=kind is not None)
        while kind is None and self._waiting:
            self._waiting.popleft().result()

    def run(self, function: Callable[..., None], *arguments: Any, **named: Any) -> None:
        """Have a function called; waits where many wait already."""
        self._waiting.append(self._thread.submit(function, *arguments, **named))
        if len(self._waiting) > _WAITING:
            self._waiting.popleft().result()
