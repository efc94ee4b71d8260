"""The protocols of a worker, which does jobs in another process, and of the driver's link to it.

To add a place where workers run: a `Link` in this package, and its line in `settings.py`.
"""

from collections.abc import Callable, Iterator
from typing import Any, Protocol

from infthor_eval.errors import InfthorError


class WorkerLostError(InfthorError):
    """A worker is gone: its process was killed, or its machine is down."""

    exit_code = 1


class Worker(Protocol):
    """Does jobs, one after the other, in its own process."""

    @property
    def greeting(self) -> Any:
        """What the driver learns before the first job; it can be pickled."""

    def do(self, job: Any) -> Iterator[Any]:
        """Do a job and yield its results, for pickling. The caller may stop after any of them."""

    def close(self) -> None:
        """Release all resources."""


class OpenWorker(Protocol):
    """Creates a worker in the process where it works; it is pickled and sent there."""

    def __call__(self, number: int) -> Worker:
        """Create the worker of this number, from 1."""


class Link(Protocol):
    """The driver's link to one worker. One thread opens it and gives jobs; another may stop it."""

    def open(self) -> Any:
        """Start the worker, or start it again after it was lost, and return its greeting.

        Raises:
            WorkerLostError: the worker ended before it was ready.
            InfthorError: the worker cannot be created, for the reason that it sent.
        """

    def do(self, job: Any) -> Iterator[Any]:
        """Yield the results of a job as they arrive.

        Raises:
            WorkerLostError: the worker ended before the job did; the results so far are valid.
            InfthorError: the worker raised it, likewise OSError and MemoryError.
        """

    def stop(self) -> None:
        """Stop the present job after its next result."""

    def close(self) -> None:
        """End the worker, whatever it is doing."""


Connect = Callable[[int], Link]  # given the number of a worker
