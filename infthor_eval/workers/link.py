"""A worker and the wire to it: what does jobs elsewhere, and how the driver sees it."""

from collections.abc import Callable, Iterator
from typing import Any, Protocol

from infthor_eval.errors import InfthorError

__all__ = ["Connect", "Link", "OpenWorker", "Worker", "WorkerLostError"]


class WorkerLostError(InfthorError):
    """A worker is not there any more: its process was killed, its machine is gone."""

    exit_code = 1


class Worker(Protocol):
    """What does jobs, one after the other, in a process of its own."""

    @property
    def greeting(self) -> Any:
        """What the driver is told of it before its first job; it can be pickled."""
        ...

    def do(self, job: Any) -> Iterator[Any]:
        """Do a job: results as they come, which can be pickled. It may be left off after any of them."""
        ...

    def close(self) -> None:
        """Let go of what it holds."""
        ...


class OpenWorker(Protocol):
    """How a worker is made where it is to work; it is pickled and sent there."""

    def __call__(self, number: int) -> Worker:
        """Make it.

        Args:
            number: of the worker, from 1.
        """
        ...


class Link(Protocol):
    """One worker as the driver sees it; one thread opens it and gives it jobs, another may stop it."""

    def open(self) -> Any:
        """Start the worker, anew where it was lost; its greeting.

        Raises:
            WorkerLostError: it ended before it was ready.
            InfthorError: it says that it cannot be made.
        """
        ...

    def do(self, job: Any) -> Iterator[Any]:
        """The results of a job, as they come.

        Raises:
            WorkerLostError: it ended before the job did; results that came are good.
            InfthorError: what the worker raised, likewise OSError and MemoryError.
        """
        ...

    def stop(self) -> None:
        """Have the job in hand left off after its next result."""
        ...

    def close(self) -> None:
        """End the worker, whatever it does."""
        ...


Connect = Callable[[int], Link]  # of a worker's number
