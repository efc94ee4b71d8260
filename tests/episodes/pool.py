"""Simulator processes that runs of different tests use one after the other."""

from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import pytest

from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator

__all__ = ["Pool", "pool", "shared_simulators"]

Options = tuple[tuple[str, Any], ...]


class Pool:
    """Simulators by their options; each is one episode's at a time, as in `Simulators`."""

    def __init__(self) -> None:
        self.open = ExitStack()
        self._idle: dict[Options, SimpleQueue[Simulator]] = defaultdict(SimpleQueue)

    @contextmanager
    def one(self, **options: Any) -> Iterator[Simulator]:
        idle = self._idle[tuple(sorted(options.items()))]
        try:
            simulator = idle.get_nowait()
        except Empty:
            simulator = self.open.enter_context(
                Simulator(embedded_launch(), max_copies=64, **options)
            )
        try:
            yield simulator
        finally:
            idle.put(simulator)

    def simulators_type(self) -> type:
        """Return a class that takes the place of `Simulators`."""
        pool = self

        class Shared:
            def __init__(
                self, name: str, scenes: Path | None, trajectories: object, **options: Any
            ) -> None:
                self._options = options

            def one(self) -> Any:
                return pool.one(**self._options)

            def close(self) -> None:
                """Leave them to other tests."""

        return Shared


@pytest.fixture(scope="session")
def pool() -> Iterator[Pool]:
    """The pool of a package's tests."""
    pool = Pool()
    with pool.open:
        yield pool


@pytest.fixture
def shared_simulators(pool: Pool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Has runs of episodes use the shared processes instead of starting their own."""
    monkeypatch.setattr("infthor_eval.episodes.evaluation.Simulators", pool.simulators_type())
